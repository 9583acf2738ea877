# SPDX-License-Identifier: MIT
"""No module and no class of the add-on has mutable state outside scene/base/session.py."""

from collections import Counter
from pathlib import Path

import pytest
from layers import sources
from module_state import entries, found

ROOT = Path(__file__).resolve().parents[2]
SCENE, LOGIC = "scene/base/planted.py", "logic/planted.py"


@pytest.fixture(scope="module")
def files():
    return {k: v for k, v in sources(ROOT, "addon").items() if k.endswith(".py")}


def test_nothing_remembers_without_the_registry(files):
    assert found(files) == []


def test_each_entry_has_a_name_of_its_own(files):
    names = entries(files)
    assert len(names) > 50
    assert [name for name, count in Counter(names).items() if count > 1] == []


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ("_found = {}", "_found can change"),
        ("_found: dict[int, str] = {}", "_found can change"),
        ("_found = []", "_found can change"),
        ("_found = [n for n in NAMES]", "_found can change"),
        ("_found = {1, 2}", "_found can change"),
        ("_found = dict()", "_found can change"),
        ("_found = set()", "_found can change"),
        ("_found = deque(maxlen=3)", "_found can change"),
        ("_found = collections.defaultdict(list)", "_found can change"),
        ("_found = weakref.WeakKeyDictionary()", "_found can change"),
        ("_found = WeakSet()", "_found can change"),
        ("_found = itertools.count()", "_found can change"),
        ("_found = _State()", "_found can change"),
        ("_found = np.zeros(3)", "_found can change"),
        ("_found = (1, [])", "_found can change"),
        ("try:\n    pass\nfinally:\n    _found = {}", "_found can change"),
        ("FOUND = defaultdict(list)", "FOUND can change"),
        ("FOUND = WeakValueDictionary()", "FOUND can change"),
        ("FOUND = deque()", "FOUND can change"),
        ("FOUND = _State()", "FOUND can change"),
        ("FOUND = {}\ndef f():\n    FOUND[1] = 2", "FOUND is changed"),
        ("FOUND = {}\ndef f():\n    del FOUND[1]", "FOUND is changed"),
        ("FOUND = []\ndef f():\n    FOUND.append(1)", "FOUND is changed"),
        ("FOUND = set()\ndef f(other):\n    other.FOUND.discard(1)", "FOUND is changed"),
        ("FOUND = []\nFOUND += [1]", "FOUND is changed"),
        ("_count = 0\ndef f():\n    global _count\n    _count += 1", "global _count"),
        ("@lru_cache(maxsize=3)\ndef f(a):\n    return a", "f is cached without session"),
        ("@functools.cache\ndef f(a):\n    return a", "f is cached without session"),
        ("class C:\n    kept = []", "C.kept can change"),
        ("class C:\n    class D:\n        kept = {}", "C.D.kept can change"),
        ("class C:\n    def f(self):\n        C.kept = 1", "C.kept is rebound"),
        ("class C:\n    def f(cls):\n        cls.kept = 1", "cls.kept is rebound"),
        ("from . import other\ndef f():\n    other.kept = 1", "other.kept is rebound"),
        ("def f(kept=[]):\n    kept.append(1)", "a default can change"),
    ],
)
def test_what_remembers_is_found(line, what):
    files = {SCENE: line, "scene/base/other.py": ""}
    assert [row.partition(": ")[2] for row in found(files)] == [what]


@pytest.mark.parametrize(
    "line",
    [
        "from . import session\n_found: dict[int, str] = session.table('a', ('load',))",
        "from . import session as registry\n_found = registry.keep('a', set, ('load',))",
        "from . import session\n@session.cached(('load',))\ndef f(a):\n    return a",
        "_WIDTHS = {'location': 3}",
        "_NAMES = [n for n in other.NAMES]",
        "_KEY = np.array([1.0, 2.0])",
        "_LOCK = threading.Lock()",
        "name = ('a', 1, frozenset({2}))",
        "_pattern = re.compile('a')",
        "Face = tuple[int, int]",
        "Owned = TypeVar('Owned')",
        "class C(NamedTuple):\n    a: int\nZERO = C(0)",
        "@dataclass(frozen=True)\nclass C:\n    a: int = 0\nZERO = C()",
        "@dataclass\nclass C:\n    a: list[int] = field(default_factory=list)",
        "class C(Operator):\n    bl_options = {'UNDO'}",
        "def f():\n    found = {}\n    found[1] = 2\n    return found",
        "class C:\n    def f(self):\n        self.kept = []",
    ],
)
def test_what_cannot_change_is_allowed(line):
    assert found({SCENE: line}) == []


def test_rooms_without_session_have_their_caches_adopted():
    files = {LOGIC: "@cache\ndef table():\n    return 1"}
    assert found(files) == [f"{LOGIC}:2: table is cached without session"]
    adopted = "session.adopt(('quit',), planted.table)"
    assert found({**files, "registration.py": adopted}) == []
    files = {SCENE: files[LOGIC], "registration.py": adopted}  # rooms with session must use it
    assert found(files) == [f"{SCENE}:2: table is cached without session"]
