"""neumann beside Mitsuba 3 at equal error: the same scene files, by turns, on the same cores.

    python3 -m venv /tmp/others && /tmp/others/bin/pip install mitsuba numpy      # Mitsuba's llvm variants want LLVM's library as well
    cargo build --release
    /tmp/others/bin/python examples/beside_mitsuba.py [SCENE...] [--rounds 6] [--seconds 3] [--size 256] [--variant llvm_ad_rgb] [--json FILE]

Scenes: cornell (the box with two blocks), caustic (a glass and a mirror ball in it), indirect (lit by way of its ceiling alone), plates
(Veach's), as neumann's built-in scenes have them, or any Mitsuba scene's .xml with an independent sampler. One variant of Mitsuba at a time: two in
one process were seen to wait for one another for ever.

Every contender renders so many independent images as there are rounds, each of about as many seconds. Loading, compiling and writing are not counted;
the pilots that choose neumann's composite are, and the start of its process.
Errors are relative squared ones, (x - r)^2 / (r^2 + 0.01), by the variance between a contender's own images, so that no reference has to be better
than they are; r is the mean of all images of methods that carry all light. What one by design does not carry (a light tracer sees nothing in mirrors) is
part of its error, by the square of how far its mean lies from r, less what both means err by; its error without that is told as well.
Efficiency is 1 / (error x seconds). "x best" is over the best of Mitsuba's, of all pixels and with the worst 0.1 % left out; "x best of its own" is over
the best by errors without what is left out; "off" is how far the image's mean lies from r's, in the contender's own standard errors.
"""

import argparse
import json
import math
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import mitsuba as mi
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
# Orders 0 to 15, as Mitsuba counts.
MAX_DEPTH = 16
# The scattering from which others' walks play roulette, as neumann's do.
ROULETTE = 5
WHITE, RED, GREEN = "0.725, 0.71, 0.68", "0.63, 0.065, 0.05", "0.14, 0.45, 0.091"


def quad(origin, u, v, bsdf, radiance=None):
    """A rectangle by a corner and its sides, whose front is that of u x v."""
    normal = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
    columns = [np.array(u) / 2, np.array(v) / 2, normal, np.array(origin) + np.array(u) / 2 + np.array(v) / 2]
    rows = [" ".join(f"{column[i]:.9g}" for column in columns) for i in range(3)]
    light = f'<emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter>' if radiance else ""
    matrix = " ".join(rows) + " 0 0 0 1"
    return f'<shape type="rectangle"><transform name="to_world"><matrix value="{matrix}"/></transform><ref id="{bsdf}"/>{light}</shape>'


def sphere(center, radius, bsdf, radiance=None):
    x, y, z = center
    light = f'<emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter>' if radiance else ""
    place = f'<point name="center" x="{x}" y="{y}" z="{z}"/><float name="radius" value="{radius}"/>'
    return f'<shape type="sphere">{place}<ref id="{bsdf}"/>{light}</shape>'


def block(low, high, bsdf, faces, place=lambda p: p):
    """Some of the six faces of a block, each seen from outside."""
    corner = lambda i: np.array(place([high[axis] if i >> axis & 1 else low[axis] for axis in range(3)]))
    all_faces = {"back": (0, 2, 1), "front": (4, 5, 6), "left": (0, 4, 2), "right": (1, 3, 5), "top": (2, 6, 3), "bottom": (0, 1, 4)}
    return "".join(quad(corner(a), corner(b) - corner(a), corner(c) - corner(a), bsdf) for a, b, c in map(all_faces.get, faces))


def scene(fov, origin, target, size, content):
    diffuse = lambda name, value: f'<bsdf type="diffuse" id="{name}"><rgb name="reflectance" value="{value}"/></bsdf>'
    materials = diffuse("white", WHITE) + diffuse("red", RED) + diffuse("green", GREEN) + diffuse("lamp", "0.78, 0.78, 0.78")
    return f"""<scene version="3.0.0">
<sensor type="perspective"><float name="fov" value="{fov}"/>
<transform name="to_world"><lookat origin="{origin}" target="{target}" up="0, 1, 0"/></transform>
<sampler type="independent"><integer name="sample_count" value="16"/></sampler>
<film type="hdrfilm"><integer name="width" value="{size}"/><integer name="height" value="{size}"/>
<string name="pixel_format" value="rgb"/><rfilter type="box"/></film></sensor>
{materials}
{content}</scene>"""


def room(size, content):
    walls = (
        quad((-1, -1, 1), (2, 0, 0), (0, 0, -2), "white")
        + quad((-1, 1, -1), (2, 0, 0), (0, 0, 2), "white")
        + quad((-1, -1, -1), (2, 0, 0), (0, 2, 0), "white")
        + quad((-1, -1, 1), (0, 0, -2), (0, 2, 0), "red")
        + quad((1, -1, -1), (0, 0, 2), (0, 2, 0), "green")
    )
    return scene(39.3077, "0, 0, 3.9", "0, 0, 0", size, walls + content)


def turned(scale, degrees, move):
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return lambda p: [scale[0] * p[0] * cos + scale[2] * p[2] * sin + move[0], scale[1] * p[1] + move[1], scale[2] * p[2] * cos - scale[0] * p[0] * sin + move[2]]


CEILING_LAMP = quad((-0.23, 0.999, -0.19), (0.46, 0, 0), (0, 0, 0.38), "lamp", "17, 12, 4")
SHORT = block((-1, -1, -1), (1, 1, 1), "white", ["back", "front", "left", "right", "top"], turned((0.3, 0.3, 0.3), -17, (0.335, -0.7, 0.38)))
TALL = block((-1, -1, -1), (1, 1, 1), "white", ["back", "front", "left", "right", "top"], turned((0.3, 0.6, 0.3), 17, (-0.33, -0.4, -0.28)))


def cornell(size):
    return room(size, CEILING_LAMP + SHORT + TALL)


def caustic(size):
    glass = '<bsdf type="dielectric" id="glass"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf>'
    mirror = '<bsdf type="conductor" id="mirror"><string name="material" value="none"/><rgb name="specular_reflectance" value="0.95, 0.95, 0.95"/></bsdf>'
    balls = sphere((0.45, -0.65, 0.25), 0.35, "glass") + sphere((-0.4, -0.6, -0.35), 0.4, "mirror")
    return room(size, glass + mirror + CEILING_LAMP + balls)


def indirect(size):
    shade = '<bsdf type="twosided" id="shade"><bsdf type="diffuse"><rgb name="reflectance" value="0.5, 0.5, 0.5"/></bsdf></bsdf>'
    lamp = quad((-0.58, -0.2, -0.58), (0, 0, 0.16), (0.16, 0, 0), "lamp", "840, 670, 500")
    walls = block((-0.6, -0.4, -0.6), (-0.4, 0, -0.4), "shade", ["back", "front", "left", "right", "bottom"])
    return room(size, shade + SHORT + lamp + walls)


def plates(size):
    """The built-in `veach_mis`."""
    diffuse = lambda name, albedo: f'<bsdf type="diffuse" id="{name}"><rgb name="reflectance" value="{albedo}, {albedo}, {albedo}"/></bsdf>'
    content = diffuse("wall", 0.4) + diffuse("black", 0)
    content += quad((-12, -4.4, 12), (24, 0, 0), (0, 0, -15), "wall") + quad((-12, -4.4, -3), (24, 0, 0), (0, 16, 0), "wall")
    for alpha, y, z, up, back in [
        (0.005, -2.1477, 0.689, 0.6954, -0.9779),
        (0.02, -3.002, 1.8445, 0.504, -1.089),
        (0.05, -3.6681, 3.276, 0.3362, -1.1519),
        (0.1, -4.092, 4.8929, 0.1841, -1.1858),
    ]:
        metal = f'<string name="material" value="none"/><string name="distribution" value="ggx"/><float name="alpha" value="{alpha}"/>'
        content += f'<bsdf type="roughconductor" id="metal{alpha}">{metal}<rgb name="specular_reflectance" value="0.6, 0.6, 0.6"/></bsdf>'
        content += quad((-4, y, z), (8, 0, 0), (0, up, back), f"metal{alpha}")
    for x, radius, radiance in [
        (-3.4, 0.9, "1.23457, 0.987654, 0.740741"),
        (-1.1, 0.3, "9.77778, 9.77778, 7.11111"),
        (1.1, 0.1, "64, 88, 88"),
        (3, 0.03, "666.667, 844.444, 1155.56"),
    ]:
        content += sphere((x, 0.6, 0), radius, "black", radiance)
    return scene(37, "0, 2, 15", "0, -1.9, 0", size, content)


SCENES = {"cornell": cornell, "caustic": caustic, "indirect": indirect, "plates": plates}


def numbers(text):
    """The numbers of an attribute of a file."""
    return [float(word) for word in text.replace(",", " ").split()]


def sides(shape):
    """Half the sides of a rectangle of a file, and its middle."""
    matrix = np.array(numbers(shape.find("transform/matrix").get("value"))).reshape(4, 4)
    return matrix[:3, 0], matrix[:3, 1], matrix[:3, 3]


class Neumann:
    """A method of neumann, with settings if they are not its own."""

    def __init__(self, file, folder, method, sampler, *settings):
        self.name, self.is_other, self.squares = f"neumann {' '.join([method, *settings])}, {sampler}", False, False
        self.out, self.stats = folder / "image.exr", folder / "stats.json"
        program = str(ROOT / "target/release/neumann")
        self.command = [program, "render", str(file), "-i", method, "--sampler", sampler, "--max-order", str(MAX_DEPTH - 1), "--replicates", "1"]
        self.command += [word for setting in settings for word in ("--set", setting)]
        self.command += ["--layers", "beauty", "-q", "-o", str(self.out), "--stats", str(self.stats)]

    def render(self, spp, seed):
        begun = time.perf_counter()
        ended = subprocess.run([*self.command, "--spp", str(spp), "--seed", str(seed)], capture_output=True, text=True)
        took = time.perf_counter() - begun
        if ended.returncode:
            sys.exit(ended.stderr)
        image = mi.Bitmap(str(self.out)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
        seconds = json.loads(self.stats.read_text())["seconds"]
        return np.array(image, dtype=np.float64), took - seconds["load"] - seconds["build"] - seconds["write"]


class Mitsuba:
    """An integrator of Mitsuba in one of its variants."""

    def __init__(self, file, folder, integrator, variant, sampler):
        self.name, self.is_other, self.variant, self.squares = f"mitsuba {integrator}, {variant}, {sampler}", True, variant, sampler == "multijitter"
        mi.set_variant(variant)
        text = re.sub(r"<integrator.*?</integrator>", "", file.read_text(), flags=re.S)
        copy = file.parent / f".{file.stem}_{sampler}.xml"
        if 'sampler type="independent"' not in text:
            sys.exit(f"error: {file} has no independent sampler, for which Mitsuba's best could be put")
        copy.write_text(text.replace('sampler type="independent"', f'sampler type="{sampler}"'))
        try:
            self.scene = mi.load_file(str(copy))
        finally:
            copy.unlink()
        self.integrator = mi.load_dict({"type": integrator, "max_depth": MAX_DEPTH, "rr_depth": ROULETTE})

    def render(self, spp, seed):
        mi.set_variant(self.variant)
        begun = time.perf_counter()
        image = np.array(mi.render(self.scene, integrator=self.integrator, spp=spp, seed=seed), dtype=np.float64)
        return image[..., :3], time.perf_counter() - begun


def samples_for(contender, seconds):
    """Samples that take about so long, of a number that the sampler can have, found by a quarter of it: a short render mostly begins."""
    contender.render(16, 1)
    spp, took = 4, 0
    while took < seconds / 4 and spp < 1024:
        spp *= 4
        took = contender.render(spp, 2)[1]
    spp *= seconds / max(took, 1e-3)
    root = max(4, int(math.sqrt(spp)))
    return min(root * root, 1024) if contender.squares else max(16, 2 ** round(math.log2(spp)))


def neumann_contenders(file, folder):
    methods = [["path"], ["adaptive"], ["coherent"], ["coherent_bdpt"], ["coherent_bdpt", "own_samples=path"], ["light"], ["bdpt"], ["adaptive_bdpt"], ["composite"]]
    return [Neumann(file, folder, method, "sobol", *settings) for method, *settings in methods]


def contenders_of(file, folder, args):
    return neumann_contenders(file, folder) + [Mitsuba(file, folder, integrator, args.variant, "multijitter") for integrator in ("path", "ptracer")]


def compare(name, args, contenders_of):
    """Renders a scene by contenders, of a function that makes them, and prints a table."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        file = Path(name)
        if name in SCENES:
            file = folder / f"{name}.xml"
            file.write_text(SCENES[name](args.size))
        contenders = contenders_of(file, folder, args)
        spp = [samples_for(contender, args.seconds) for contender in contenders]
        images, seconds = [[] for _ in contenders], [[] for _ in contenders]
        for seed in range(10, 10 + args.rounds):
            for i, contender in enumerate(contenders):
                image, took = contender.render(spp[i], seed)
                images[i].append(image)
                seconds[i].append(took)
    rows = rows_of(name, contenders, spp, [np.stack(image) for image in images], seconds)
    print_table(name, rows)
    return rows


# Of all pixels, with the worst left out, and of all pixels without the light that a method does not carry.
EFFICIENCIES = {"efficiency": "x best", "efficiency_of_most": "x best, most", "efficiency_of_its_own": "x best of its own"}


def rows_of(name, contenders, spp, images, seconds):
    """What the table says of each contender."""
    rounds = len(seconds[0])
    means, variances = [x.mean(0) for x in images], [x.var(0, ddof=1) for x in images]
    # A light tracer sees nothing in mirrors.
    whole = [i for i, contender in enumerate(contenders) if "light" not in contender.name and "ptracer" not in contender.name]
    weights = {i: 1 / variances[i].mean() for i in whole}
    total = sum(weights.values())
    truth = sum(means[i] * weight for i, weight in weights.items()) / total
    variance_of_truth = sum(variances[i] * (weight / total) ** 2 for i, weight in weights.items()) / rounds
    rows = []
    for i, contender in enumerate(contenders):
        left_out = 0 if i in whole else (means[i] - truth) ** 2 - variances[i] / rounds - variance_of_truth
        error, of_its_own = ((squares / (truth**2 + 0.01)).mean(-1).ravel() for squares in (variances[i] + left_out, variances[i]))
        most = np.sort(error)[: math.floor(len(error) * 0.999)]
        each = images[i].mean((1, 2, 3))
        standard = math.hypot(each.std(ddof=1), truth.mean() * 1e-12) / math.sqrt(rounds)
        took = float(np.mean(seconds[i]))
        row = {"scene": name, "contender": contender.name, "other": contender.is_other, "spp": spp[i], "seconds": took}
        row |= {key: float(1 / (pixels.mean() * took)) for key, pixels in zip(EFFICIENCIES, (error, most, of_its_own))}
        rows.append(row | {"mean": float(each.mean()), "off": float((each.mean() - truth.mean()) / standard)})
    return rows


def print_table(name, rows):
    best = {key: max(row[key] for row in rows if row["other"]) for key in EFFICIENCIES}
    print(f"{name}\n  {'':44} {'spp':>6} {'seconds':>8} {'efficiency':>11} {'  '.join(EFFICIENCIES.values())} {'mean':>9} {'off':>6}")
    for row in rows:
        ratios = "  ".join(f"{row[key] / best[key]:{len(title)}.2f}" for key, title in EFFICIENCIES.items())
        print(
            f"  {row['contender']:44} {row['spp']:6} {row['seconds']:8.2f} {row['efficiency']:11.3g} {ratios} {row['mean']:9.5f} {row['off']:+6.1f}",
            flush=True,
        )


def arguments(doc, scenes):
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=scenes, help="names of scenes, or files")
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--json", type=Path)
    return parser


def compare_all(args, contenders_of):
    rows = [row for name in args.scenes for row in compare(name, args, contenders_of)]
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1))


def main():
    parser = arguments(__doc__, list(SCENES))
    parser.add_argument("--variant", default="llvm_ad_rgb")
    args = parser.parse_args()
    mi.set_variant(args.variant)
    compare_all(args, contenders_of)


if __name__ == "__main__":
    main()
