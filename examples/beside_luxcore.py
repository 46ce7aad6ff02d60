"""neumann beside LuxCoreRender 2.11 at equal error: the same scenes, by turns, on the same cores.

    python3 -m venv /tmp/others && /tmp/others/bin/pip install mitsuba numpy pyluxcore      # Python 3.11; Mitsuba only reads neumann's images here
    cargo build --release
    /tmp/others/bin/python examples/beside_luxcore.py [SCENE...] [--rounds 6] [--seconds 3] [--size 256] [--json FILE]

Scenes: cornell, caustic and indirect of `beside_mitsuba.py`, whose files are read here, and whose table and statistics these are. The plates are left
out, as the distribution of LuxCore's rough metals (Schlick's) isn't GGX.

LuxCore's engines are PATHCPU and BIDIRCPU, each with its Sobol sampler, as many threads as there are cores, a box filter of one pixel, no clamping
or caches, and the image as it stands before any tone mapping. Its time runs from the start of a session's threads to their end: the scene and its
acceleration structure are built before. What differs from neumann's:

- PATHCPU has roulette from its fifth scattering, of a probability of at least a half, which is its default. By it indirect's mean comes out too
  bright by about 1 %, the others' by nothing that was seen; without it, none.
- BIDIRCPU has none. By its default roulette, images come out too bright by much more: cornell's and caustic's by 6 %, indirect's by 15 %.
- PATHCPU renders orders 0 to 15, as neumann does. BIDIRCPU bounds its two walks and not the path, so that it adds some of the light of orders 16 to
  32; orders 16 to 31 are 0.02 % of the light or less in these scenes.
- Balls are meshes with smooth normals: LuxCore has no spheres that aren't lamps.
- LuxCore's image lies one row too low, against which its window is moved.
"""

import atexit
import contextlib
import io
import os
import sys
import time
import xml.etree.ElementTree as ElementTree

import mitsuba as mi
import numpy as np

from beside_mitsuba import MAX_DEPTH, ROULETTE, arguments, compare_all, neumann_contenders, numbers, sides

# Mitsuba has to be loaded before LuxCore, which brings another allocator: the process ends by "invalid pointer" otherwise.
mi.set_variant("scalar_rgb")
with contextlib.redirect_stdout(io.StringIO()):
    import pyluxcore

SCENES = ["cornell", "caustic", "indirect"]
# The rows of triangles from pole to pole of a ball.
BALL_ROWS = 128


def words(values):
    return " ".join(f"{value:.9g}" for value in values)


def properties(values):
    result = pyluxcore.Properties()
    result.SetFromString("\n".join(f"{key} = {value}" for key, value in values.items()))
    return result


def rectangle(shape):
    """Corners, triangles and normals (none) of a rectangle, whose front is that of Mitsuba's."""
    u, v, middle = sides(shape)
    return np.array([middle - u - v, middle + u - v, middle + u + v, middle - u + v]), [(0, 1, 2), (0, 2, 3)], None


def ball(shape):
    """Corners, triangles and normals of a sphere."""
    center = [float(shape.find("point").get(axis)) for axis in "xyz"]
    radius = float(shape.find("float[@name='radius']").get("value"))
    theta, columns = np.linspace(0, np.pi, BALL_ROWS + 1), 2 * BALL_ROWS
    phi = np.arange(columns) * (2 * np.pi / columns)
    normals = np.stack([np.outer(np.sin(theta), np.cos(phi)), np.outer(np.cos(theta), np.ones(columns)), np.outer(np.sin(theta), np.sin(phi))], -1)
    triangles = []
    for row in range(BALL_ROWS):
        for column in range(columns):
            a, b = row * columns + column, row * columns + (column + 1) % columns
            triangles += [(a, b, b + columns)] if row > 0 else []
            triangles += [(a, b + columns, a + columns)] if row < BALL_ROWS - 1 else []
    normals = normals.reshape(-1, 3)
    return center + radius * normals, triangles, normals


def material(bsdf):
    """LuxCore's settings of one of Mitsuba's BSDFs."""
    kind = bsdf.get("type")
    number = lambda name: bsdf.find(f"float[@name='{name}']").get("value")
    color = lambda name: words(numbers(bsdf.find(f"rgb[@name='{name}']").get("value")))
    if kind == "twosided":
        return material(bsdf.find("bsdf"))
    if kind == "diffuse":
        return {"type": "matte", "kd": color("reflectance")}
    if kind == "dielectric":
        return {"type": "glass", "kr": "1 1 1", "kt": "1 1 1", "interiorior": number("int_ior"), "exteriorior": number("ext_ior")}
    if kind == "conductor":
        return {"type": "mirror", "kr": color("specular_reflectance")}
    sys.exit(f"error: no material of LuxCore is the same as Mitsuba's {kind}")


def emission(shape):
    """Radiance on the front, without further scaling."""
    radiance = words(numbers(shape.find("emitter/rgb").get("value")))
    return {"emission": radiance, "emission.gain": "1 1 1", "emission.power": 0, "emission.efficency": 0, "emission.theta": 90}


def camera(sensor):
    size = int(sensor.find("film/integer[@name='height']").get("value"))
    look = sensor.find("transform/lookat")
    place = {f"lookat.{key}": words(numbers(look.get(name))) for key, name in [("orig", "origin"), ("target", "target")]}
    # One row lower than the square, as LuxCore takes the row above the one it should.
    window = words([-1, 1, -1 - 2 / size, 1 - 2 / size])
    settings = {"type": "perspective", **place, "up": words(numbers(look.get("up"))), "screenwindow": window, "autofocus.enable": 0}
    return {**settings, "fieldofview": sensor.find("float[@name='fov']").get("value")}, size


def load(file):
    """LuxCore's scene of a file of Mitsuba's, and the length of the image's sides."""
    root = ElementTree.parse(file).getroot()
    settings, size = camera(root.find("sensor"))
    values = {f"scene.camera.{key}": value for key, value in settings.items()}
    add = lambda name, settings: values.update({f"scene.materials.{name}.{key}": value for key, value in settings.items()})
    for bsdf in root.findall("bsdf"):
        add(bsdf.get("id"), material(bsdf))
    add("back", {"type": "matte", "kd": "0 0 0"})
    scene = pyluxcore.Scene()
    for i, shape in enumerate(root.findall("shape")):
        name = shape.find("ref").get("id")
        if shape.find("emitter") is not None:
            # Black on its back, as Mitsuba's.
            add(f"lamp{i}", {"type": "twosided", "frontmaterial": name, "backmaterial": "back", **emission(shape)})
            name = f"lamp{i}"
        points, triangles, normals = rectangle(shape) if shape.get("type") == "rectangle" else ball(shape)
        rows = lambda array: [tuple(row) for row in array.tolist()]
        scene.DefineMesh(f"mesh{i}", rows(points), triangles, None if normals is None else rows(normals), None, None, None)
        values |= {f"scene.objects.object{i}.shape": f"mesh{i}", f"scene.objects.object{i}.material": name}
    scene.Parse(properties(values))
    return scene, size


class LuxCore:
    """An engine of LuxCore."""

    def __init__(self, file, engine):
        self.name, self.is_other, self.squares = f"luxcore {engine}, sobol", True, False
        self.scene, self.size = load(file)
        self.settings = {
            "renderengine.type": engine,
            "native.threads.count": os.cpu_count(),
            "sampler.type": "SOBOL",
            "sampler.sobol.adaptive.strength": 0,
            "film.width": self.size,
            "film.height": self.size,
            "film.filter.type": "NONE",
            "path.clamping.variance.maxvalue": 0,
            # Of PATHCPU's walk.
            **{f"path.pathdepth.{kind}": MAX_DEPTH for kind in ("total", "diffuse", "glossy", "specular")},
            # Of BIDIRCPU's two.
            "path.maxdepth": MAX_DEPTH,
            "light.maxdepth": MAX_DEPTH,
            "path.russianroulette.depth": ROULETTE if engine == "PATHCPU" else 1000,
        }

    def render(self, spp, seed):
        config = pyluxcore.RenderConfig(properties({**self.settings, "batch.haltspp": spp, "renderengine.seed": seed}), self.scene)
        session = pyluxcore.RenderSession(config)
        # This builds the acceleration structure, and has the threads begin at its end.
        session.Start()
        begun = time.perf_counter()
        while not session.HasDone():
            time.sleep(0.002)
            session.UpdateStats()
        session.Stop()
        took = time.perf_counter() - begun
        image = np.zeros(3 * self.size * self.size, dtype=np.float32)
        session.GetFilm().GetOutputFloat(pyluxcore.FilmOutputType.RGB, image)
        # LuxCore's rows begin at the bottom.
        return image.reshape(self.size, self.size, 3)[::-1].astype(np.float64), took


def contenders_of(file, folder, args):
    return neumann_contenders(file, folder) + [LuxCore(file, engine) for engine in ("PATHCPU", "BIDIRCPU")]


def main():
    args = arguments(__doc__, SCENES).parse_args()
    pyluxcore.Init(lambda message: None)
    # The handler can't be dropped any more once Python is on its way out.
    atexit.register(pyluxcore.SetLogHandler, None)
    compare_all(args, contenders_of)


if __name__ == "__main__":
    main()
