"""The rooms import one way only. Read from the source, so that an import inside a function counts as well."""

import ast
from functools import cache
from pathlib import Path

FLYSIM = Path(__file__).resolve().parents[1] / "flysim"
FILES = sorted(FLYSIM.rglob("*.py"))
NAMES = {path: ".".join(("flysim", *path.relative_to(FLYSIM).with_suffix("").parts)) for path in FILES}

# The rooms from the ground up: each may import those before it that it needs, and none after it.
ROOMS = {
    "plain": set(),
    "errors": {"plain"},
    "common": {"foreign"},
    "foreign": set(),
    "compute": set(),
    "geometry": {"common", "foreign"},
    "products": {"geometry"},
    "worlds": {"common", "foreign", "compute", "geometry"},
    "robots": {"foreign", "geometry", "worlds"},
    "stereo": {"compute", "geometry"},
    "calibration": {"common", "foreign", "geometry"},
    "sensors": {"common", "geometry", "calibration"},
    "flies": {"common", "compute", "geometry", "products", "stereo"},
    "engines": {"common", "foreign", "compute", "geometry", "products", "stereo", "flies"},
    "localise": {"common", "geometry", "products"},
    "obstacles": {"compute", "geometry", "products", "stereo", "flies"},
    "paths": {"geometry", "worlds", "robots"},
    "sim": {"common", "foreign", "geometry", "worlds", "robots"},
    "render": {"common", "foreign", "geometry", "worlds", "robots", "sim"},
    "truth": {"geometry", "worlds"},
    "sources": {
        *("common", "geometry", "products", "worlds", "robots", "sim", "render", "sensors", "truth", "calibration"),
    },
    "evaluate": {"common", "geometry", "products", "worlds", "truth"},
    "photographs": {"foreign", "geometry", "calibration", "products", "flies", "obstacles"},
    "datasets": {"common", "foreign", "geometry", "products", "worlds", "truth", "photographs"},
    "record": {"common", "foreign", "geometry", "products", "worlds", "truth", "evaluate"},
}
for room in ROOMS.keys() - {"plain", "errors"}:
    ROOMS[room] |= {"errors", "plain"}  # what everybody says, and how
ROOMS["registration"] = {"nav"}
ROOMS["runs"] = set(ROOMS) - {"registration"}
ROOMS["nav"] = {*ROOMS} - {"runs", "evaluate", "registration"}
ROOMS["studies"] = {*ROOMS}
ROOMS["cli"] = {*ROOMS}
ROOMS["__main__"] = {"cli"}
ROOMS["__init__"] = {*ROOMS}
ONLY_IN = {
    "numba": ("compute/", "flies/threads.py"),
    "llvmlite": "compute/",
    "pybullet": "sim/",
    "moderngl": "render/",
    "rerun": ("record/recording.py", "record/recording_world.py", "record/blueprint.py", "record/live.py"),
    "matplotlib": ("record/", "studies/"),
    "cv2": (
        "datasets/level.py",
        "stereo/",
        "flies/regions.py",
        "engines/",
        "sim/",
        "render/",
        "sensors/",
        "localise/",
        "nav/picture.py",
        "photographs/",
        "foreign/video.py",
        "foreign/deep.py",
        "calibration/",
    ),
    "ray": "common/on_ray.py",
    "pyarrow": ("record/files.py", "products/tables.py"),  # a swarm can be handed on without a run
    "gymnasium": "nav/",
    "stable_baselines3": "nav/",
    "torch": "nav/training/",
    "typer": "cli/",
    "rich": "cli/terminal.py",
    "rosbags": ("datasets/mcap.py", "datasets/mcap_write.py"),
    "onnxruntime": "engines/network.py",
    "yaml": ("foreign/", "robots/xacro_child.py"),
    "zipfile": "foreign/",
    "tomllib": ("foreign/", "runs/scenario.py", "common/overrides.py"),
    "pydantic": ("runs/scenario.py", "runs/scenario_parts.py", "runs/pairs.py"),
    "xacro": "robots/xacro_child.py",
}
# Loaded where they are used: each takes tenths of a second.
NOT_AT_MODULE_LEVEL = {
    *("yaml", "torch", "rerun", "matplotlib", "sklearn", "trimesh", "pyarrow", "ray", "rosbags", "onnxruntime")
}


@cache
def tree(path):
    """A file, parsed once for all that is asked of it."""
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def calls(path):
    """(what is called, as it stands there, and its line) of each call in a file."""
    return [(ast.unparse(node.func), node.lineno) for node in ast.walk(tree(path)) if isinstance(node, ast.Call)]


@cache
def imports(path):
    """(module, whether it runs when the module is imported, line) of each import but those for types alone."""
    found = []

    def walk(node, top):
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.dump(child.test):
                continue
            if isinstance(child, ast.Import):
                found.extend((alias.name, top, child.lineno) for alias in child.names)
            elif isinstance(child, ast.ImportFrom):
                assert child.level == 0, f"{path}:{child.lineno}: write the whole name"
                # The version is the package's own, and no room's.
                aliases = [alias for alias in child.names if (child.module, alias.name) != ("flysim", "__version__")]
                names = [f"{child.module}.{alias.name}" for alias in aliases]
                rooms = [name if name in NAMES.values() else child.module for name in names]
                found.extend((room, top, child.lineno) for room in rooms)
            walk(child, top and not isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef))

    walk(tree(path), True)
    return found


def place(path):
    return path.relative_to(FLYSIM).as_posix()


def room_of(module):
    return module.split(".")[1] if "." in module else "__init__"


def none(found):
    """Fails with all that was found, a line each."""
    assert not (lines := list(found)), "\n".join(lines)


def test_every_room_has_its_place():
    none(
        f"{place(path)}: a new room; give it its place in ROOMS" for path in FILES if room_of(NAMES[path]) not in ROOMS
    )


def test_imports_run_one_way():
    none(
        f"{place(path)}:{line}: {room} may not import {module}"
        for path in FILES
        for room in [room_of(NAMES[path])]
        for module, _, line in imports(path)
        if module.startswith("flysim") and room_of(module) not in (room, *ROOMS.get(room, ()))
    )


def test_libraries_stay_in_their_rooms():
    wrong = []
    for path in FILES:
        for module, top, line in imports(path):
            library = module.split(".")[0]
            if library in ONLY_IN and not place(path).startswith(ONLY_IN[library]):
                wrong.append(f"{place(path)}:{line}: {library} belongs elsewhere")
            if top and library in NOT_AT_MODULE_LEVEL:
                wrong.append(f"{place(path)}:{line}: import {library} where it is used")
    none(wrong)


def test_only_the_terminal_prints():
    """All that is shown goes through the one module that makes it plain."""
    none(
        f"{place(path)}:{line}: {called}()"
        for path in FILES
        if place(path) != "cli/terminal.py"
        for called, line in calls(path)
        if called in ("print", "input", "sys.stdout.write") or called.endswith((".echo", ".secho", ".print"))
    )


# Reads that a limit cannot be put on; the few that are left read what flysim itself wrote, or count as they read.
OPENS = (
    "compute/kernel_cache.py",
    "compute/plugged.py",
    "sim/",
    "render/",
    "cli/interrupt.py",
    "foreign/",
    "record/viewer.py",
    "record/scene.py",
    "studies/machine.py",
)


def test_somebody_elses_file_is_opened_in_one_room():
    reads = (".read_text", ".read_bytes", "json.load", "json.loads", "np.load", "Image.open")
    none(
        f"{place(path)}:{line}: {called}()"
        for path in FILES
        if not place(path).startswith(OPENS)
        for called, line in calls(path)
        if called.endswith(reads) and called != "self.read_bytes" and not called.startswith("folder.")
    )


def test_files_are_short_and_say_what_they_are_for():
    wrong = []
    for path in FILES:
        lines = len(path.read_text(encoding="utf-8").splitlines())
        if lines > 300:
            wrong.append(f"{place(path)} has {lines} lines: one concept a file")
        if not ast.get_docstring(tree(path)):
            wrong.append(f"{place(path)} has no docstring")
    none(wrong)


def test_the_rooms_have_an_order():
    order, left = [], {room: set(below) - {room} for room, below in ROOMS.items()}
    while left:
        ready = [room for room, below in left.items() if below <= set(order)]
        assert ready, f"these import each other in a circle: {sorted(left)}"
        order += ready
        left = {room: below for room, below in left.items() if room not in ready}


def test_no_files_import_each_other_in_a_circle():
    """Inside of rooms too, and for types alone as well: who reads one file needs no other that needs this one."""
    by_name = {name: path for path, name in NAMES.items()}
    after = {name: set() for name in by_name}
    for name, path in by_name.items():
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.ImportFrom):
                wholes = (f"{node.module}.{alias.name}" for alias in node.names)
                after[name] |= {whole if whole in by_name else node.module for whole in wholes} & by_name.keys()
            elif isinstance(node, ast.Import):
                after[name] |= {alias.name for alias in node.names} & by_name.keys()
    circles = set()
    for name in by_name:
        reached, todo = set(), [name]
        while todo:
            new = after[todo.pop()] - reached
            reached |= new
            todo += new
        if name in reached:
            circles.add(name)
    assert not circles


def functions(path):
    """Of each function its name, lines without its docstring, and arguments without the object it belongs to."""
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            arguments = [one.arg for one in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
            told = node.body[0] if ast.get_docstring(node, clean=False) is not None else None
            lines = node.end_lineno - node.lineno + 1 - (told.end_lineno - told.lineno + 1 if told else 0)
            yield node.name, lines, len(arguments) - (arguments[:1] in (["self"], ["cls"]))


def test_functions_are_short_and_take_a_dozen_arguments_at_most():
    wrong = []
    for path in FILES:
        for name, lines, arguments in functions(path):
            if lines > 60:
                wrong.append(f"{place(path)}: {name} has {lines} lines")
            if arguments > 12:
                wrong.append(f"{place(path)}: {name} has {arguments} arguments: bundle some")
    none(wrong)


def test_one_noun_has_one_meaning():
    found = {}
    for path in FILES:
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found.setdefault(node.name, []).append(place(path))
    assert not {name: places for name, places in found.items() if len(places) > 1}
