// tagrid-read-tiff: TIFF files, and folders of slices.

#include "io/readers/serve.h"
#include "tools/readers/tiff/tiff_volumes.h"

int main() { return tagrid::serve_volumes("tiff", tagrid::open_tiff); }
