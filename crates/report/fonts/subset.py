"""Cuts the two weights of Inter down to what pictures need.

Usage: python subset.py FOLDER, with FOLDER holding Inter-Regular.woff2 and Inter-SemiBold.woff2.
Needs fonttools and brotli. See README.md beside this file.
"""

import sys
from pathlib import Path

from fontTools.subset import Options, Subsetter
from fontTools.ttLib import TTFont

# Latin, Greek and Cyrillic with their extensions, punctuation, raised and lowered digits, currency,
# letterlike signs, fractions, arrows and mathematical signs. Combining marks are left out: they
# would need a text shaper to stand where they belong.
RANGES = [
    (0x0020, 0x007E), (0x00A0, 0x024F), (0x0370, 0x03FF), (0x0400, 0x052F), (0x1E00, 0x1FFF),
    (0x2000, 0x206F), (0x2070, 0x209F), (0x20A0, 0x20BF), (0x2100, 0x218F), (0x2190, 0x22FF),
    (0x25A0, 0x25FF), (0xFFFD, 0xFFFD),
]

for weight in ["Regular", "SemiBold"]:
    font = TTFont(Path(sys.argv[1]) / f"Inter-{weight}.woff2")
    # Digits and signs of one width, so that numbers stand below one another.
    for table in font["cmap"].tables:
        for code, name in table.cmap.items():
            if chr(code) in "0123456789+−" and f"{name}.tf" in font["hmtx"].metrics:
                table.cmap[code] = f"{name}.tf"
    options = Options(layout_features=[], hinting=False, notdef_outline=True, glyph_names=False)
    options.name_IDs = [0, 1, 2, 3, 4, 5, 6, 7, 13, 14]
    options.drop_tables += ["GDEF", "GPOS", "GSUB"]
    subsetter = Subsetter(options)
    subsetter.populate(unicodes=[code for low, high in RANGES for code in range(low, high + 1)])
    subsetter.subset(font)
    font.flavor = None
    font["head"].modified = font["head"].created  # the same bytes whenever it is run
    font.recalcTimestamp = False
    font.save(Path(__file__).with_name(f"inter-{weight.lower()}-subset.ttf"))
