// tagrid-read-bmp: reads folders of BMP slices, which SkyScan's programs write.

#include "tools/formats/bmp/bmp_volumes.h"

int main() { return tagrid::serve_volumes("bmp", tagrid::open_bmp); }
