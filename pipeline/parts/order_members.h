// The numbers of members of the structs that ranks send each other; see messages.h. A wrong number does not
// compile.
#pragma once

#include "pipeline/parts/decode_parts.h"
#include "pipeline/parts/part_work.h"
#include "pipeline/parts/source_contents.h"
#include "pipeline/parts/verify_parts.h"
#include "pipeline/ranks/messages.h"

namespace tagrid {

template <>
inline constexpr std::size_t member_count<Index3> = 3;
template <>
inline constexpr std::size_t member_count<RawDescription> = 5;
template <>
inline constexpr std::size_t member_count<SourceDescription> = 7;
template <>
inline constexpr std::size_t member_count<Resources> = 4;

template <>
inline constexpr std::size_t member_count<PartOrder> = 6;
template <>
inline constexpr std::size_t member_count<PartPlace> = 2;
template <>
inline constexpr std::size_t member_count<PlaceOrder> = 5;
template <>
inline constexpr std::size_t member_count<DecodeOrder> = 6;
template <>
inline constexpr std::size_t member_count<WrittenNumbers> = 2;
template <>
inline constexpr std::size_t member_count<ValueRule> = 4;
template <>
inline constexpr std::size_t member_count<VerifyOrder> = 4;

template <>
inline constexpr std::size_t member_count<ContentOrder> = 3;
template <>
inline constexpr std::size_t member_count<SourceFiles> = 7;
template <>
inline constexpr std::size_t member_count<SampleShape> = 2;
template <>
inline constexpr std::size_t member_count<EnvelopeFile> = 5;
template <>
inline constexpr std::size_t member_count<SlicesInFile> = 3;
template <>
inline constexpr std::size_t member_count<SliceRun> = 8;
template <>
inline constexpr std::size_t member_count<StoredBits> = 3;
template <>
inline constexpr std::size_t member_count<PlainPiece> = 5;

template <>
inline constexpr std::size_t member_count<Statistics> = 10;
template <>
inline constexpr std::size_t member_count<OpenFace> = 3;
template <>
inline constexpr std::size_t member_count<Findings> = 2;

}  // namespace tagrid
