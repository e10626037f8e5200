// tagrid-read-jp2: reads folders of JPEG 2000 slices with OpenJPEG.

#include "tools/formats/jp2/jp2_volumes.h"

int main() { return tagrid::serve_volumes("jp2", tagrid::open_jp2); }
