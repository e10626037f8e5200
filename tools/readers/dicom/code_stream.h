// What the code stream of an image says of a loss, whatever the attributes of its file say.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace tagrid {

/// Whether the code stream of the first frame was made with a loss: by the irreversible wavelet of JPEG 2000 (9-7), or as
/// near-lossless JPEG-LS. `fragments`: the byte of the file at which they begin; `syntax`: the UID of its transfer syntax.
/// Nothing if the stream does not say, for it is damaged, or of another kind. Throws WorldError.
std::optional<bool> has_lossy_stream(const std::string& path, std::uint64_t fragments,
                                     const std::string& syntax);

}  // namespace tagrid
