"""help_test.py COMMAND: each verb's help says the default of every option that takes a value.

It stands behind the type, "FLOAT=60", or at the end of the text, "[no limit]". Without one are those that are REQUIRED, those of a
group of which one is, and a FILE, FOLDER or MAP, which is neither read nor written unless it is named.
"""

import re
import subprocess
import sys
import unittest

COMMAND = sys.argv[1]
# "  --cell FLOAT:more than 0  m: of height grids [the map's resolution]"; a flag's name has two blanks behind it, or no type. What is
# before the text may be too long for two blanks.
OPTION = re.compile(r" +(-\S+) ([A-Z]{2,})\b(.*?)(?:  +(.*))?")


def help_of(*verb):
    return subprocess.run([COMMAND, *verb, "--help"], capture_output=True, text=True, timeout=60, check=True).stdout


def options_in(text):
    """Of each that takes a value its name, type, what is behind that, and its text."""
    for section in text[text.index("\nUsage: "):].split("\n\n"):
        if "[Exactly 1 of the following options is required]" in section:
            section = section[:section.index("[Exactly 1 ")]
        for line in re.sub(r"\n {20,}(?=\S)", "  ", section).splitlines():
            if found := OPTION.fullmatch(line):
                yield found.groups()


class Help(unittest.TestCase):
    def test_says_the_default_of_every_option_that_has_one(self):
        verbs = re.findall(r"^  (\w+) ", help_of().split("\nVerbs:\n")[1], re.MULTILINE)
        self.assertGreater(len(verbs), 12)
        silent, read = [], 0
        for verb in verbs:
            for name, kind, behind, text in options_in(help_of(verb)):
                read += 1
                shown = "=" in behind or "REQUIRED" in behind or (text or behind).endswith("]")
                if not shown and kind not in ("FILE", "FOLDER", "MAP"):
                    silent.append(f"{verb} {name}")
        self.assertEqual(silent, [])
        self.assertGreater(read, 100)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]], verbosity=2)
