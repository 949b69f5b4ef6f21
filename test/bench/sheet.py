"""One picture of the worst of a benchmark's wrong faces: truth, seen cells and found surfaces, and why each is wrong."""

import math
import textwrap
from xml.sax.saxutils import escape

WIDTH, TOP, COLUMN, ROW, FRAME, PICTURE = 1500, 54, 296, 372, 284, 254  # px; in each panel a picture of FRAME x PICTURE
COLUMNS, MOST, HEAD, LINE = 5, 10, 38, 44  # panels: in a row, in all; letters: of a panel's first line, of the others
COLOURS = ("#0072b2", "#e69f00", "#cc79a7", "#009e73", "#d55e00", "#56b4e9", "#f0e442")  # Okabe and Ito's
LIGHT, GREY, MOST_RUNS, MOST_BYTES = "#f7f1d5", "#c8c8c8", 400, 14_500  # of seen cells, and in all, in a panel: files stay small
TRUTH, FOUND = 'fill="{}" stroke="#111" stroke-width="{:.3g}"', 'fill="{0}" fill-opacity=".4" stroke="{0}" stroke-width="{1:.3g}"'


def worst(rows, count=MOST):
    """The wrong faces of the largest area that their best surface gets wrong, each with its row's sensor, scene and seed."""
    def key(face):
        wrong = face["visible_m2"] * (1 - (face["by_surface"] or 0) * (face["of_surface"] or 0))
        return -wrong, face["sensor"], face["scene"], face["seed"], face["id"]
    faces = [{**face, **{name: row[name] for name in ("sensor", "scene", "seed")}} for row in rows for face in row.get("wrong", ())]
    return sorted({key(face)[1:]: face for face in sorted(faces, key=key, reverse=True)}.values(), key=key)[:count]  # each once


def runs(seen):
    """Edge of a block in cells, and runs [row of blocks, first cell, end]: the edge grows until they are few. No cell is lost."""
    step = 1
    while True:
        merged = []
        for row, first, end in sorted((row // step, column, column + count) for row, column, count in seen):
            if merged and merged[-1][0] == row and first - merged[-1][2] < step:
                merged[-1][2] = max(merged[-1][2], end)
            else:
                merged.append([row, first, end])
        if len(merged) <= MOST_RUNS:
            return step, merged
        step += 1 + step // 4


def box(polygons):
    return [(min(values), max(values)) for values in zip(*(point for polygon in polygons for point in polygon["outer"]))]


def path(polygons, style, closest, note=""):
    """In whole mm, v up; a vertex closer (mm) to the one before is left out, and a ring without three."""
    text = ""
    for ring in (ring for polygon in polygons for ring in (polygon["outer"], *polygon.get("holes", ()))):
        kept = [(math.inf, 0)]
        for point in ((round(1000 * u), round(-1000 * v)) for u, v in ring):
            kept += [point] if math.dist(kept[-1], point) >= closest else []
        if len(kept) > 3:
            text += "M{} {}l".format(*kept[1]) + " ".join(f"{x - a} {y - b}" for (a, b), (x, y) in zip(kept[1:], kept[2:])) + "z"
    return f'<path {style} fill-rule="evenodd" d="{text}">{note}</path>'


def why(face):
    """What is wrong, in words: from the verdict and its numbers."""
    best, others = face["by_surface"] or 0, face.get("fused_with")
    text = f"seen in pieces: best {100 * best:.0f} % of it" if face["covered"] >= 0.2 else "nothing found"
    if face["verdict"] == "over-segmented":  # its parts' middles are on it, unlike those of surfaces beside it
        boxes = [list(zip(box(found["polygons"]), box(face["truth"]))) for found in face["found"] if found["polygons"]]
        text = f"{max(2, sum(all(low < sum(part) / 2 < high for part, (low, high) in both) for both in boxes))} surfaces on one face"
    elif face["verdict"] == "under-segmented" and others:
        angle, offset = others[0]["angle_deg"], abs(1000 * others[0]["offset_m"])
        text = f"one surface with {others[0]['name']} (" + (f"{angle:.0f}°" if angle >= 3 else f"{offset:.0f} mm") + " apart)"
        text += f" and {len(others) - 1} more" if others[1:] else ""
    elif face["covered"] >= 0.2 and best > face["of_surface"]:
        text = f"best: {100 * best:.0f} % of it, but {100 * (1 - face['of_surface']):.0f} % of that surface lies elsewhere"
    angle, offset = face["normal_deg"] or 0, 1000 * abs(face["offset_m"] or 0)
    off = [f"{angle:.1f}°"] * (angle > 1) + [f"{offset:.0f} mm"] * (offset > 5)
    return text + (f"; best is off by {' and '.join(off)}" if off and best else "")


def panel(face, x, y, sensor, closest=0.5):
    found, (step, lines), ends = [each for each in face["found"] if each["polygons"]], runs(face["seen"]), []
    room = 0.3 * max(high - low for low, high in box(face["truth"]))  # for surfaces that reach beyond the face
    for axis, (low, high) in enumerate(box(face["truth"])):
        reach = [min(max(end, low - room), high + room) for each in found for end in box(each["polygons"])[axis]]
        ends += [(min(low, *reach, low), max(high, *reach, high))]
    pixel = 1120 * max((high - low) / size for (low, high), size in zip(ends, (FRAME, PICTURE)))  # mm
    left, top = 500 * sum(ends[0]) - pixel * FRAME / 2, -500 * sum(ends[1]) - pixel * PICTURE / 2
    cell, rim, frame = 1000 * face["cell"], y + PICTURE, f'x="{x}" y="{y}" width="{FRAME}" height="{PICTURE}"'
    seen = "".join(f"M{first * cell:.0f} {-(row + 0.5) * step * cell:g}H{end * cell:.0f}" for row, first, end in lines)
    seen = f'<path stroke="{GREY}" stroke-width="{step * cell:g}" d="{seen}"/>'
    svg = f'<svg {frame} viewBox="{left:.1f} {top:.1f} {pixel * FRAME:.1f} {pixel * PICTURE:.1f}">'
    svg += path(face["truth"], TRUTH.format(LIGHT, 0), closest * pixel) + seen + \
        path(face["truth"], TRUTH.format("none", 3 * pixel), closest * pixel)
    for i, each in enumerate(found):
        note = f"<title>surface {each['id']}: {each['angle_deg']:.1f}°, {each['offset_mm']:.0f} mm</title>"
        svg += path(each["polygons"], FOUND.format(COLOURS[i % len(COLOURS)], 1.2 * pixel), closest * pixel, note)
    bar = max((digit * 10 ** power for power in range(5) for digit in (1, 2, 5) if digit * 10 ** power < pixel * FRAME / 3), default=1)
    svg += f'</svg><rect {frame} fill="none" stroke="#bbb"/><path d="M{x + 1} {rim + 6}v8m0-4h{bar / pixel:.1f}m0-4v8" stroke="#111"/>'
    svg += f'<text x="{x + bar / pixel + 8:.0f}" y="{rim + 14}">{bar / 1000:g} m</text>'
    head = f"{sensor}{face['scene']} seed {face['seed']}, {face['name']}"
    area = f"{face['visible_m2']:.{2 if face['visible_m2'] >= 0.1 else 3}f} m², {100 * face['covered']:.0f} % covered"
    reason = textwrap.wrap(why(face).replace(" mm", "\xa0mm").replace(" %", "\xa0%"), LINE, max_lines=3, placeholder="…")
    for i, text in enumerate((head if len(head) <= HEAD else head[:HEAD - 1] + "…", area, *reason)):
        svg += f'<text x="{x}" y="{rim + 36 + 17 * i}" font-weight="{"normal" if i else "bold"}">{escape(text)}</text>'
    return svg if len(svg.encode()) < MOST_BYTES else panel(face, x, y, sensor, 2 * closest)


def sheet(title, faces):
    """The first ten faces, as worst() gives them, as an SVG."""
    height, mixed = TOP + ROW * math.ceil(len(faces[:MOST]) / COLUMNS), len({face["sensor"] for face in faces[:MOST]}) > 1
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" font-family="sans-serif" font-size="12">'
    svg += f'<rect width="100%" height="100%" fill="#fff"/><text x="14" y="34" font-size="20">{escape(title)}</text>'
    for x, style, text in ((980, TRUTH.format(LIGHT, 3), "true face"), (1080, f'fill="{GREY}"', "seen by a scan"),
                           (1220, FOUND.format(COLOURS[0], 1.2), "found surfaces, each in a colour")):
        svg += f'<path d="M{x} 20h22v14h-22z" {style}/><text x="{x + 30}" y="32">{text}</text>'
    for i, face in enumerate(faces[:MOST]):
        svg += "\n" + panel(face, 14 + COLUMN * (i % COLUMNS), TOP + ROW * (i // COLUMNS), f"{face['sensor']}, " * mixed)
    return svg + "</svg>\n"
