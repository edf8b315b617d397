"""Published ways out of numexpr, asteval, simpleeval and eval: every one is refused by the grammar, with a column.

Sources: numexpr issues 323 and 442 and CVE-2023-39631; asteval issues 32 and 86 and CVE-2025-24359;
simpleeval issue 138 and its own test suite's list; N. Batchelder, "Eval really is dangerous" (2012).
"""

import pytest

from core.expression import ExpressionError, evaluate, parse

SUBCLASSES = "().__class__.__bases__[0].__subclasses__()"

PAYLOADS = [
    # numexpr
    "(lambda fc=(lambda n: [c for c in ().__class__.__bases__[0].__subclasses__() if c.__name__ == n][0]):"
    " fc('function')(fc('code')(0,0,0,0,0,b'a',(),(),(),'','',0,b''),{})())()",
    "__import__('os').system('echo pwned')",
    "(3+1).__class__.__bases__[0].__subclasses__()[140].__init__.__globals__['system']('id')",
    "a.__class__", "exec('import os')", "eval('1')", "import os; os.system('id')", "a = 5; b",
    "a if b else [c for c in d]",
    "().__class__", "lambda x: x", "{1: 2}", "{1, 2}", "x@y", "a._attr", "a.real.__class__", "a['b']",
    "(1).real.conj().__class__", "where(a.__init__, 1, 2)", "0x1.__class__", "'%s' % a", "u.T", "u.imag", "a;b", "#",
    "forbidden()", "arctan2(a,b).__init__()", "e.real()", "sum(a).base", "a\\.b", "a\x2e__class__", "__builtins__",
    # asteval
    "print.__reduce__()", "print.__reduce__()[0](print.__reduce__()[1][0], 'symtable')",
    "f'{().__class__}'", "f\"{x.__class__.__bases__}\"", "'{0.__class__}'.format(1)", "'{.__globals__}'.format(sin)",
    "str.format('{0.__init__.__globals__}', sin)", "type(str)('x', (), {})", "type('x', (object,), {'a': 1})",
    "open('/etc/passwd').read()", "fromfile('/etc/passwd')", "loadtxt('/etc/passwd')", "savetxt('/tmp/x', [1])",
    "load('x.npy', allow_pickle=1)", "ctypeslib.ctypes", "lib.npyio.os.system('id')", "numpy.lib", "linalg.linalg",
    "def f(): pass", "f.body[0]", "while 1: pass", "[x for x in range(9)]", "try: 1/0\nexcept: 1", "raise 1", "del u",
    "os.environ", "getattr(u, 'base')", "setattr(u, 'base', 1)", "globals()", "locals()", "vars()", "dir()",
    "compile('1', '', 'eval')", "breakpoint()", "input()", "help()", "memoryview(u)", "u.tofile('/tmp/x')",
    "u.dump('x')",
    "u.ctypes.data", "u.__array_interface__", "u.base.base", "u.setflags(1)",
    # simpleeval
    "foo.bar().gi_frame.f_globals['__builtins__'].exec('raise RuntimeError')", "foo.bar().cr_frame.f_globals",
    "'i want to break' * 9999999", "''.join(['x'] * 10)", "[1] * 10 ** 9", "('x' * 10 ** 9)", "'a'.ljust(10 ** 9)",
    "{}.__class__.__base__.__subclasses__()", "[].__class__.__base__", "(lambda: 0).__code__",
    "(lambda: 0).func_globals",
    "x.mro()", "''.__class__.__mro__[-1]", SUBCLASSES, f"{SUBCLASSES}[0]", "max.__self__", "max.__module__",
    "sin.__doc__",
    "rand.__globals__", "sin.func_globals", "(sin)", "min(sin, cos)", "sin if 1 else cos", "(sin)(1)", "sin(1)(2)",
    "u(1)", "u()", "(u)(1)", "u if u else u(1)", "[*u]", "max(*u)", "max(**u)", "max(a=1)", "sin(x=1)", "u := 1",
    "yield 1", "await u", "async u", "1 if u else __import__", "...", "Ellipsis.__class__", "None", "True", "u is v",
    "u in v", "u.__sub\u0063lasses__", "\uff55.\uff3f\uff3fclass", "\u1d64\u1d65", "u\u2024real", "~u", "u >> 1",
    "u << 99999999",
    "u | v", "1 <> 2", "`u`", "u->v", "$u", "u\x00", "u;v",
]


@pytest.mark.parametrize("source", PAYLOADS, ids=range(len(PAYLOADS)))
def test_refused(source):
    with pytest.raises(ExpressionError) as caught:
        parse(source, ("u", "v", "t", "frame", "id"))
    assert 1 <= caught.value.column <= len(source) + 1


def test_there_are_many():
    assert len(set(PAYLOADS)) >= 100


@pytest.mark.parametrize("source", [
    "9**9**9**9**9", "10 ** 10 ** 10", "9999999 ** 9999999", "2 ** 2 ** 2 ** 2 ** 2 ** 2", "-9 ** 9 ** 9",
    "1e30 * 1e30 * 1e30",
    "exp(exp(exp(100)))", "0 ** -1", "(-8) ** 0.3333", "pow(9, pow(9, 9))", "max(1, 1e30) ** 1e30",
])
def test_what_explodes_elsewhere_is_held(source):
    assert abs(float(evaluate(source))) <= 1e30
