"""What `tagrid view` of a program serves."""

import subprocess
import urllib.parse
import urllib.request


def served_page(program, file):
    """The page, and the decoder that it loads, as bytes."""
    with subprocess.Popen([program, "view", file, "--no-browser", "-q"], stdout=subprocess.PIPE, text=True) as view:
        try:
            address = view.stdout.readline().strip()
            if not address:
                raise AssertionError(f"{program} view ended")
            return [urllib.request.urlopen(urllib.parse.urljoin(address, name), timeout=20).read()
                    for name in (address, "decoder/tagrid_simd.wasm")]
        finally:
            view.terminate()
