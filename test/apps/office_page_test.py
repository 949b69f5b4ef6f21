"""office_page_test.py COMMAND MAPS: maps/office.html is the page that this command writes of maps/office."""

import base64
import gzip
import pathlib
import re
import subprocess
import sys
import tempfile

COMMAND, MAPS = sys.argv[1], pathlib.Path(sys.argv[2])
MESSAGE = re.compile(rb'(?<=class="map">)[^<]*(?=</script>)')


def contents(page):
    """What is around its messages, and what these say: compressors of other machines may pack it otherwise."""
    return MESSAGE.sub(b"", page), [gzip.decompress(base64.b64decode(one)) for one in MESSAGE.findall(page)]


with tempfile.TemporaryDirectory() as folder:
    made = pathlib.Path(folder, "office.html")
    done = subprocess.run([COMMAND, "view", MAPS / "office", "--html", made], capture_output=True, text=True)
    if "built without the page" in done.stderr:
        print("skipped: built without the page")
        sys.exit(77)
    assert done.returncode == 0, done
    kept = MAPS / "office.html"
    if contents(made.read_bytes()) != contents(kept.read_bytes()):
        sys.exit("maps/office.html is another page: octosurf view maps/office --html maps/office.html --force")
    assert kept.stat().st_size < 1_500_000, "it has to be opened at once"
