"""Expressions: what an artist types into a field, in a grammar of our own that can do arithmetic and nothing else.

Numbers; names (``id``, ``u``, ``v``, ``t``, ``frame``, any map or field the craft offers; ``pi``, ``tau``);
``+ - * / % **``; ``< <= > >= == !=`` (chains too); ``and or not``; ``a if c else b``; and the functions of
``core.expression.functions``. There are no attributes, strings, subscripts, assignments or loops, and nothing is
handed to Python: the source becomes a short list of instructions over numpy arrays.

The result is always finite. Where mathematics has no answer (x / 0, x % 0, 0 ** -1, sqrt or log of a negative number,
asin(2)) the operation gives 0; what grows beyond 1e30 is held at 1e30, so that a result always fits float32.
Truth is 1 or 0; every number but 0 counts as true. Both branches of ``if`` are computed, which is harmless for the
same reason.
"""

from core.expression.parser import ExpressionError, Program, names_used, parse
from core.expression.program import MAX_COST, evaluate, hold

__all__ = ["MAX_COST", "ExpressionError", "Program", "evaluate", "hold", "names_used", "parse"]
