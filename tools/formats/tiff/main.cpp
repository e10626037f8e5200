// tagrid-read-tiff: TIFF files, and folders of slices.

#include "io/programs/serve_reader.h"
#include "tools/formats/tiff/open_tiff.h"

int main() { return tagrid::serve_volumes("tiff", tagrid::open_tiff); }
