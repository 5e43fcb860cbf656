# Renders a scene that `platelight bench cycles` wrote with Blender's Cycles, at several numbers of samples.
#   blender -b --factory-startup -P compare_with_cycles.py -- DIR THREADS RUNS CONVERGED SAMPLES...
# Writes DIR/cycles_SAMPLES_SEED.exr (RGBA, linear, premultiplied) and DIR/cycles.json with the times. CONVERGED samples
# are rendered with the seeds 2 and 3, the others with seed 1, RUNS times: the least times count.
import array
import json
import os
import re
import resource
import struct
import sys
import time

import bpy
import mathutils

directory, threads, runs, converged = sys.argv[sys.argv.index('--') + 1:][:4]
counts = [int(word) for word in sys.argv[sys.argv.index('--') + 5:]]
with open(os.path.join(directory, 'scene.json')) as file:
    made = json.load(file)

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene


def read_ply(path):
    """Vertices and normals, corners of triangles, as write_peer_scene writes them."""
    with open(path, 'rb') as file:
        data = file.read()
    end = data.index(b'end_header\n') + len(b'end_header\n')
    vertices, faces = (int(n) for n in re.findall(rb'element \w+ (\d+)', data[:end]))
    points = list(struct.iter_unpack('<6f', data[end:end + 24 * vertices]))
    triangles = struct.iter_unpack('<B3i', data[end + 24 * vertices:end + 24 * vertices + 13 * faces])
    return [p[:3] for p in points], [p[3:] for p in points], [t[1:] for t in triangles]


def flat(kind, tuples):
    return array.array(kind, [value for values in tuples for value in values])


def add_mesh(name, material, points, normals, triangles):
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(points))
    mesh.vertices.foreach_set('co', flat('f', points))
    mesh.loops.add(3 * len(triangles))
    mesh.loops.foreach_set('vertex_index', flat('i', triangles))
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set('loop_start', array.array('i', range(0, 3 * len(triangles), 3)))
    mesh.polygons.foreach_set('loop_total', array.array('i', [3]) * len(triangles))
    mesh.polygons.foreach_set('use_smooth', [normals is not None] * len(triangles))
    mesh.update()
    if normals is not None:
        mesh.use_auto_smooth = True
        mesh.normals_split_custom_set_from_vertices(normals)
    mesh.materials.append(material)
    thing = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(thing)
    return thing


class Nodes:
    """The nodes of one material, put together by calls."""

    def __init__(self, name):
        self.material = bpy.data.materials.new(name)
        self.material.use_nodes = True
        self.material.cycles.sample_as_light = False  # lamps glow, but light nothing
        self.tree = self.material.node_tree
        self.tree.nodes.clear()

    def add(self, kind, inputs=(), output=0, **settings):
        node = self.tree.nodes.new('ShaderNode' + kind)
        for name, value in settings.items():
            setattr(node, name, value)
        for socket, value in inputs:
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, node.inputs[socket])
            else:
                node.inputs[socket].default_value = value
        return node.outputs[output]

    def maths(self, operation, *values):
        return self.add('Math', enumerate(values), operation=operation)

    def mix(self, share, first, second):
        return self.add('MixShader', ((0, share), (1, first), (2, second)))

    def finish(self, surface):
        self.tree.links.new(surface, self.tree.nodes.new('ShaderNodeOutputMaterial').inputs['Surface'])
        return self.material


def glossy(nodes, colour, roughness):
    smooth = roughness < 0.02
    return nodes.add('BsdfGlossy', (('Color', colour), ('Roughness', 0.0 if smooth else roughness)),
                     distribution='SHARP' if smooth else 'GGX')


def standard_material(part):
    """The layers of render/standard.h: Schlick's shares of the view, over GGX lobes."""
    nodes = Nodes(part['name'])
    base = (*part['base'], 1)
    white = (1, 1, 1, 1)
    schlick = None
    if part['specular'] > 0 or part['metallic'] > 0 or part['coat'] > 0:
        geometry = nodes.add('NewGeometry').node
        cosine = nodes.add('VectorMath', ((0, geometry.outputs['Incoming']), (1, geometry.outputs['Normal'])),
                           output='Value', operation='DOT_PRODUCT')
        grazing = nodes.maths('SUBTRACT', 1.0, nodes.maths('ABSOLUTE', cosine))
        schlick = nodes.maths('POWER', grazing, 5.0)

    def share(scale):  # scale * (.04 + .96 (1 - cosine)^5)
        return nodes.maths('MULTIPLY_ADD', schlick, 0.96 * scale, 0.04 * scale)

    surface = nodes.add('BsdfDiffuse', (('Color', base), ('Roughness', 0.0)))
    if part['specular'] > 0 and part['metallic'] < 1:
        surface = nodes.mix(share(part['specular']), surface, glossy(nodes, white, part['roughness']))
    if part['metallic'] > 0:
        colour = nodes.add('MixRGB', ((0, schlick), (1, base), (2, white)))
        metal = glossy(nodes, colour, part['roughness'])
        surface = nodes.mix(part['metallic'], surface, metal)
    if part['coat'] > 0:
        surface = nodes.mix(share(part['coat']), surface, glossy(nodes, white, part['coat_roughness']))
    if any(part['emission']):
        glow = nodes.add('Emission', (('Color', (*part['emission'], 1)), ('Strength', 1.0)))
        surface = nodes.add('AddShader', ((0, surface), (1, glow)))
    return nodes.finish(surface)


def glass_material(part):
    """Solid glass; straight through for shadows, as GlassParameters::shadow has it.

    Cycles gathers the sky's light on dull surfaces by shadow rays and by rays of the surface's own directions, each
    weighed so that both together are all of it: what lets one kind through has to let the other through as well.
    """
    nodes = Nodes(part['name'])
    glass = nodes.add('BsdfGlass', (('Color', (1, 1, 1, 1)), ('Roughness', 0.0), ('IOR', part['index'])),
                      distribution='SHARP')
    clear = nodes.add('BsdfTransparent', (('Color', (*part['shadow'], 1)),))
    path = nodes.add('LightPath').node.outputs
    for_light = nodes.maths('MAXIMUM', path['Is Shadow Ray'], path['Is Diffuse Ray'])
    return nodes.finish(nodes.mix(for_light, glass, clear))


for part in made['parts']:
    material = glass_material(part) if part['model'] == 'glass' else standard_material(part)
    add_mesh(part['name'], material, *read_ply(os.path.join(directory, part['file'])))

# The floor: Lambert, seen by the camera and through glass; it takes no light from the objects.
nodes = Nodes('floor')
matte = nodes.finish(nodes.add('BsdfDiffuse', (('Color', (*made['floor_albedo'], 1)), ('Roughness', 0.0))))
corners = [(-30, -30, 0), (30, -30, 0), (30, 30, 0), (-30, 30, 0)]
floor = add_mesh('floor', matte, corners, None, [(0, 1, 2), (0, 2, 3)])
floor.visible_shadow = floor.visible_diffuse = floor.visible_glossy = False

world = scene.world = bpy.data.worlds.new('sky')
world.use_nodes = True
sky = world.node_tree.nodes.new('ShaderNodeTexEnvironment')
sky.image = bpy.data.images.load(os.path.join(os.path.abspath(directory), made['light']))
sky.image.colorspace_settings.name = 'Linear'
sky.interpolation = 'Linear'
world.node_tree.links.new(sky.outputs['Color'], world.node_tree.nodes['Background'].inputs['Color'])

lens = bpy.data.cameras.new('camera')
lens.sensor_fit = 'VERTICAL'
lens.sensor_height = 24
lens.lens = 24 * made['focal_px'] / made['height']
lens.clip_start = 0.01
camera = scene.camera = bpy.data.objects.new('camera', lens)
scene.collection.objects.link(camera)
turn, at = made['camera']['set_from_cam'], made['camera']['position']
# Blender's cameras look along -z, with y up.
camera.matrix_world = mathutils.Matrix(
    [[turn[3 * i], -turn[3 * i + 1], -turn[3 * i + 2], at[i]] for i in range(3)] + [[0, 0, 0, 1]])

render, cycles = scene.render, scene.cycles
render.engine = 'CYCLES'
render.threads_mode, render.threads = 'FIXED', int(threads)
render.use_persistent_data = False
render.film_transparent = True
render.dither_intensity = 0
render.resolution_percentage = 100
render.image_settings.file_format = 'OPEN_EXR'
render.image_settings.color_mode = 'RGBA'
render.image_settings.color_depth = '32'
scene.view_settings.view_transform = 'Raw'
cycles.device = 'CPU'
cycles.use_denoising = False
cycles.use_adaptive_sampling = False
cycles.pixel_filter_type = 'BOX'
cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
cycles.blur_glossy = 0
cycles.max_bounces = 0 if made['direct_light_only'] else 32
cycles.diffuse_bounces = 0
cycles.glossy_bounces = cycles.transmission_bounces = 32
cycles.transparent_max_bounces = 32


def cpu_s():
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def rendered(name, samples, seed, width, height):
    cycles.samples, cycles.seed = samples, seed
    render.resolution_x, render.resolution_y = width, height
    render.filepath = os.path.join(os.path.abspath(directory), name)
    cpu, wall = cpu_s(), time.monotonic()
    bpy.ops.render.render(write_still=True)
    cpu, wall = cpu_s() - cpu, time.monotonic() - wall
    with open(render.filepath, 'rb') as file:
        header = file.read(8192)
    # Cycles' own count, without preparing the scene.
    stamp = re.search(rb'render_time\0string\0....(?:(\d+):)?(\d+):(\d+\.\d+)', header, re.S)
    hours, minutes, seconds = stamp.groups()
    own = 3600 * int(hours or 0) + 60 * int(minutes) + float(seconds)
    return {'file': name, 'samples': samples, 'seed': seed, 'cpu_s': cpu, 'wall_s': wall, 'render_s': own}


# Preparing the scene costs CPU time in every render: a picture of next to no pixels tells how much.
preparing = min(rendered('cycles_tiny.exr', 1, 1, 8, 6)['cpu_s'] for _ in range(2))
pictures = []
for count, seed in [(count, 1) for count in counts] + [(int(converged), 2), (int(converged), 3)]:
    name = 'cycles_%d_%d.exr' % (count, seed)
    made_so = [rendered(name, count, seed, made['width'], made['height'])
               for _ in range(int(runs) if seed == 1 else 1)]
    picture = dict(made_so[0])
    for kind in ('cpu_s', 'wall_s', 'render_s'):
        picture[kind] = min(once[kind] for once in made_so)
    picture['cpu_s'] -= preparing
    pictures.append(picture)
    print('platelight', json.dumps(picture), flush=True)
with open(os.path.join(directory, 'cycles.json'), 'w') as file:
    json.dump({'version': bpy.app.version_string, 'preparing_cpu_s': preparing, 'pictures': pictures}, file, indent=2)
