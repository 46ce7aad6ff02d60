"""neumann beside Blender's Cycles 4.5 at equal error: the same scenes, by turns, on the same cores.

    python3 -m venv /tmp/others && /tmp/others/bin/pip install mitsuba numpy bpy==4.5.4      # Python 3.11; Mitsuba only reads images here
    cargo build --release
    /tmp/others/bin/python examples/beside_cycles.py [SCENE...] [--rounds 6] [--seconds 3] [--size 256] [--json FILE]

Scenes: those of `beside_mitsuba.py`, whose files are read here, and whose table and statistics these are.

Cycles runs on the CPU with as many threads as there are cores, its tabulated Sobol sampler, a box filter of one pixel, and nothing that biases: no
denoiser, no adaptive sampling, no clamping, no threshold of light, no blurring of caustics, and linear images as they stand before any view transform.
Its time is the one that it states itself, to a hundredth of a second, without the scene's set-up and Blender's own share.
What differs from neumann's, and what was chosen in favour of Cycles:

- Lamps are Cycles' own, rectangles and spheres that emit on their front. Meshes that emit have the same mean and up to thirteen times the cost at
  equal error (plates, by the light tree, without which it is more), as they are picked triangle by triangle. What lies in a lamp's place and scatters is a mesh right behind it.
- The light tree is off: one of at most four lamps is picked without it, which takes 0.4 to 0.9 of the cost by the tree.
- Roulette begins at the fifth scattering, as neumann's does. From the second, which is Cycles' default, costs 1 to 1.4 times as much. Its probability
  of going on is the root of the walk's weight.
- Path guiding is off: it costs 1.5 to 2.9 times as much, by 512 samples. It has less variance in caustic and indirect, but doubles the time.
- Cycles' first sample lies in the middle of each pixel, by which the edges of lamps are off: cornell's mean is too dark by 0.1 % at 64 samples. N
  samples are therefore those from the Nth on, as a subset of 2 N, which is as well distributed.
- Balls that aren't lamps are meshes with smooth normals. Diffuse surfaces scatter on their backs as well, which no light reaches in these scenes.
- Metals' masking is that of heights correlated, and Mitsuba's and neumann's isn't. For the plates' roughness, that was too little to be seen.
"""

import contextlib
import math
import os
import sys
import xml.etree.ElementTree as ElementTree

import bpy
import mitsuba as mi
import numpy as np
from mathutils import Matrix, Vector

from beside_mitsuba import MAX_DEPTH, ROULETTE, SCENES, arguments, compare_all, neumann_contenders, numbers, sides

mi.set_variant("scalar_rgb")

# The rows of faces from pole to pole of a ball.
BALL_ROWS = 128
# How far behind a lamp its surface lies: of a rectangle, and of a sphere by its radius.
BEHIND = 1e-4


def number(element, name):
    return float(element.find(f"float[@name='{name}']").get("value"))


def color(element, name):
    return numbers(element.find(f"rgb[@name='{name}']").get("value"))


def rectangle(shape):
    """Half the sides of a rectangle, its normal and its middle."""
    u, v, middle = sides(shape)
    return u, v, np.cross(u, v) / np.linalg.norm(np.cross(u, v)), middle


def sphere(shape):
    return np.array([float(shape.find("point").get(axis)) for axis in "xyz"]), number(shape, "radius")


def ball(center, radius):
    """Corners and faces of a sphere."""
    columns = 2 * BALL_ROWS
    theta, phi = np.arange(1, BALL_ROWS) * (np.pi / BALL_ROWS), np.arange(columns) * (2 * np.pi / columns)
    normals = np.stack([np.outer(np.sin(theta), np.cos(phi)), np.outer(np.cos(theta), np.ones(columns)), np.outer(np.sin(theta), np.sin(phi))], -1)
    normals = np.concatenate([normals.reshape(-1, 3), [[0, 1, 0], [0, -1, 0]]])
    poles = {0: len(normals) - 2, BALL_ROWS: len(normals) - 1}
    corner = lambda row, column: poles.get(row, (row - 1) * columns + column % columns)
    faces = []
    for row in range(BALL_ROWS):
        for column in range(columns):
            around = corner(row, column), corner(row, column + 1), corner(row + 1, column + 1), corner(row + 1, column)
            # Triangles at the poles.
            faces.append(tuple(dict.fromkeys(around)))
    return center + radius * normals, faces


def mesh(name, shape, behind):
    """Blender's mesh of a shape, whose front is that of Mitsuba's."""
    result = bpy.data.meshes.new(name)
    if shape.get("type") == "rectangle":
        u, v, normal, middle = rectangle(shape)
        middle = middle - behind * normal
        result.from_pydata([middle - u - v, middle + u - v, middle + u + v, middle - u + v], [], [(0, 1, 2, 3)])
    else:
        center, radius = sphere(shape)
        corners, faces = ball(center, radius * (1 - behind))
        result.from_pydata(corners, [], faces)
        result.shade_smooth()
    return result


def lamp(name, shape):
    """Blender's lamp in the place of a shape that emits."""
    radiance = np.array(numbers(shape.find("emitter/rgb").get("value")))
    if shape.get("type") == "rectangle":
        u, v, normal, middle = rectangle(shape)
        data = bpy.data.lights.new(name, "AREA")
        data.shape, data.size, data.size_y = "RECTANGLE", 2 * np.linalg.norm(u), 2 * np.linalg.norm(v)
        watts = np.pi * data.size * data.size_y
        # It shines along its -z.
        x, z = u / np.linalg.norm(u), -normal
        place = Matrix.Translation(middle) @ Matrix([x, np.cross(z, x), z]).transposed().to_4x4()
    else:
        center, radius = sphere(shape)
        data = bpy.data.lights.new(name, "POINT")
        data.shadow_soft_size, data.use_soft_falloff = radius, False
        watts = 4 * np.pi**2 * radius**2
        place = Matrix.Translation(center)
    data.energy, data.color = watts * radiance.max(), radiance / radiance.max()
    result = bpy.data.objects.new(name, data)
    # Blender hides lamps by default.
    result.matrix_world, result.visible_camera = place, True
    return result


def scattering(tree, bsdf):
    """Cycles' node of one of Mitsuba's BSDFs, and whether its back has to be made black where that can be seen."""
    kind = bsdf.get("type")

    def node(name, **values):
        result = tree.nodes.new(f"ShaderNode{name}")
        for key, value in values.items():
            result.inputs[key].default_value = [*value, 1] if isinstance(value, list) else value
        return result

    if kind == "twosided":
        return scattering(tree, bsdf.find("bsdf"))[0], False
    if kind == "diffuse":
        return node("BsdfDiffuse", Color=color(bsdf, "reflectance"), Roughness=0), False
    if kind == "dielectric":
        return node("BsdfGlass", Color=[1, 1, 1], Roughness=0, IOR=number(bsdf, "int_ior") / number(bsdf, "ext_ior")), False
    has = lambda name, value: bsdf.find(f"string[@name='{name}'][@value='{value}']") is not None
    rough = kind == "roughconductor"
    if (kind == "conductor" or rough and has("distribution", "ggx")) and has("material", "none"):
        result = node("BsdfGlossy", Color=color(bsdf, "specular_reflectance"), Roughness=math.sqrt(number(bsdf, "alpha")) if rough else 0)
        result.distribution = "GGX"
        return result, rough
    sys.exit(f"error: no material of Cycles is the same as Mitsuba's {kind}")


def material(name, bsdf, one_sided=False):
    result = bpy.data.materials.new(name)
    result.use_nodes = True
    tree = result.node_tree
    tree.nodes.clear()
    surface, black = scattering(tree, bsdf)
    if one_sided or black:
        geometry, mix, back = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("NewGeometry", "MixShader", "BsdfDiffuse"))
        back.inputs["Color"].default_value = 0, 0, 0, 1
        for i, output in enumerate([geometry.outputs["Backfacing"], surface.outputs[0], back.outputs[0]]):
            tree.links.new(output, mix.inputs[i])
        surface = mix
    tree.links.new(surface.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return result


def camera(sensor):
    data = bpy.data.cameras.new("camera")
    data.sensor_fit, data.angle = "HORIZONTAL", math.radians(number(sensor, "fov"))
    look = sensor.find("transform/lookat")
    origin, target, up = (Vector(numbers(look.get(name))) for name in ("origin", "target", "up"))
    back = (origin - target).normalized()
    right = up.cross(back).normalized()
    result = bpy.data.objects.new("camera", data)
    result.matrix_world = Matrix.Translation(origin) @ Matrix([right, back.cross(right), back]).transposed().to_4x4()
    return result


def load(file):
    """Blender's scene of a file of Mitsuba's, in the place of any before."""
    root = ElementTree.parse(file).getroot()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    add = scene.collection.objects.link
    scene.camera = camera(root.find("sensor"))
    add(scene.camera)
    bsdfs = {bsdf.get("id"): bsdf for bsdf in root.findall("bsdf")}
    materials = {name: material(name, bsdf) for name, bsdf in bsdfs.items()}
    for i, shape in enumerate(root.findall("shape")):
        name, emits = shape.find("ref").get("id"), shape.find("emitter") is not None
        surface = mesh(f"mesh{i}", shape, BEHIND if emits else 0)
        # A lamp's back is black, as Mitsuba's.
        surface.materials.append(material(f"behind{i}", bsdfs[name], True) if emits else materials[name])
        add(bpy.data.objects.new(f"object{i}", surface))
        if emits:
            add(lamp(f"lamp{i}", shape))
    film = root.find("sensor/film")
    scene.render.resolution_x, scene.render.resolution_y = (int(film.find(f"integer[@name='{side}']").get("value")) for side in ("width", "height"))
    return scene


@contextlib.contextmanager
def quiet():
    """Without what Blender writes of a render's progress."""
    sys.stdout.flush()
    kept = os.dup(1)
    with open(os.devnull, "w") as nothing:
        os.dup2(nothing.fileno(), 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


class Cycles:
    """Cycles' path tracer."""

    def __init__(self, file, folder):
        self.name, self.is_other, self.squares = "cycles path, sobol", True, False
        self.scene, self.out = load(file), folder / "cycles.exr"
        self.scene.view_settings.view_transform = "Raw"
        render = self.scene.render
        render.engine, render.resolution_percentage, render.use_persistent_data = "CYCLES", 100, True
        render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
        self.set(
            device="CPU",
            use_denoising=False,
            use_adaptive_sampling=False,
            sample_clamp_direct=0,
            sample_clamp_indirect=0,
            light_sampling_threshold=0,
            blur_glossy=0,
            caustics_reflective=True,
            caustics_refractive=True,
            pixel_filter_type="BOX",
            sampling_pattern="TABULATED_SOBOL",
            use_sample_subset=True,
            use_light_tree=False,
            use_guiding=False,
            # Cycles counts the scatterings after the first.
            max_bounces=MAX_DEPTH - 2,
            diffuse_bounces=MAX_DEPTH - 2,
            glossy_bounces=MAX_DEPTH - 2,
            transmission_bounces=MAX_DEPTH - 2,
            # Roulette begins with the second scattering after so many.
            min_light_bounces=ROULETTE - 2,
            # Of ways on through a lamp, to the surface behind it.
            transparent_max_bounces=2 * MAX_DEPTH,
        )

    def set(self, **values):
        for key, value in values.items():
            setattr(self.scene.cycles, key, value)

    def render(self, spp, seed):
        self.set(seed=seed, samples=2 * spp, sample_offset=spp, sample_subset_length=spp)
        # The settings of the render before would be taken otherwise.
        self.scene.update_tag()
        with quiet():
            bpy.ops.render.render()
            bpy.data.images["Render Result"].save_render(str(self.out))
        bitmap = mi.Bitmap(str(self.out))
        image = np.array(bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False), dtype=np.float64)
        # Of the form "01:02.34".
        took = bitmap.metadata()["cycles.ViewLayer.render_time"].split(":")
        return image, sum(float(part) * 60**i for i, part in enumerate(reversed(took)))


def contenders_of(file, folder, args):
    return neumann_contenders(file, folder) + [Cycles(file, folder)]


def main():
    compare_all(arguments(__doc__, list(SCENES)).parse_args(), contenders_of)


if __name__ == "__main__":
    main()
