"""Writes machine-independent vector code: every number is the same quantity of eight frames.

A block is a stretch of memory with one vector of eight frames in every slot, so that a 6x6 matrix
is 36 slots, row by row. The compiler sees vectors from the start and has no loops to recognise,
which is why it takes seconds rather than a minute.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from llvmlite import ir

from estimation.kernel.layout import LANES

REAL = ir.DoubleType()
LONG = ir.IntType(64)
POINTER = ir.PointerType()
VECTOR = ir.VectorType(REAL, LANES)
#: A value of the code being written; llvmlite has no types of its own.
Value = Any
Slot = int | Value
#: Products and sums may be fused; nothing is assumed of numbers that are not finite.
FAST = ("contract",)


def constant(number: int) -> Value:
    """Returns a whole number as a value."""
    return ir.Constant(LONG, number)


def splat(number: float) -> Value:
    """Returns the same number for every frame."""
    return ir.Constant(VECTOR, [number] * LANES)


class Code:
    """Writes one function, instruction by instruction, with plain Python as its macro language."""

    def __init__(
        self, module: Any, name: str, arguments: Sequence[Any], result: Any = None
    ) -> None:
        """Starts a function.

        Args:
            module: what it becomes a part of.
            name: its name.
            arguments: their types.
            result: the type of what it returns; None for nothing.
        """
        kind = ir.FunctionType(result or ir.VoidType(), arguments)
        self.module = module
        self.function = ir.Function(module, kind, name)
        self.builder = ir.IRBuilder(self.function.append_basic_block())
        self.arguments = self.function.args

    def done(self, value: Value = None) -> Any:
        """Ends the function and returns it."""
        if value is None:
            self.builder.ret_void()
        else:
            self.builder.ret(value)
        return self.function

    def at(self, block: Value, slot: Slot) -> Value:
        """Returns the address of a slot of a block."""
        return self._address(block, slot, VECTOR)

    def _address(self, base: Value, index: Slot, kind: Any) -> Value:
        if isinstance(index, int):
            if index == 0:
                return base
            index = constant(index)
        return self.builder.gep(base, [index], source_etype=kind)

    def load(self, block: Value, slot: Slot = 0) -> Value:
        """Reads a slot."""
        return self.builder.load(self.at(block, slot), typ=VECTOR, align=8 * LANES)

    def store(self, value: Value, block: Value, slot: Slot = 0) -> None:
        """Writes a slot."""
        self.builder.store(value, self.at(block, slot), align=8 * LANES)

    def loads(self, block: Value, count: int, first: int = 0) -> list[Value]:
        """Reads slots one after another."""
        return [self.load(block, first + slot) for slot in range(count)]

    def stores(self, values: Sequence[Value], block: Value, first: int = 0) -> None:
        """Writes slots one after another."""
        for slot, value in enumerate(values):
            self.store(value, block, first + slot)

    def whole(self, base: Value, index: Slot = 0) -> Value:
        """Reads a whole number from a table."""
        return self.builder.load(self._address(base, index, LONG), typ=LONG, align=8)

    def real(self, base: Value, index: Slot = 0) -> Value:
        """Reads one number from a table."""
        return self.builder.load(self._address(base, index, REAL), typ=REAL, align=8)

    def number(self, base: Value, index: Slot) -> Value:
        """Returns the address of a number in a table."""
        return self._address(base, index, REAL)

    def entry(self, table: Value, index: Slot) -> Value:
        """Reads an address from a table of addresses."""
        return self.builder.load(self._address(table, index, POINTER), typ=POINTER, align=8)

    def spread(self, number: Value) -> Value:
        """Gives every frame the same number, known at run time."""
        first = self.builder.insert_element(splat(0.0), number, constant(0))
        mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        return self.builder.shuffle_vector(first, first, mask)

    def add(self, left: Value, right: Value) -> Value:
        """Returns the sum."""
        return self.builder.fadd(left, right, flags=FAST)

    def subtract(self, left: Value, right: Value) -> Value:
        """Returns the difference."""
        return self.builder.fsub(left, right, flags=FAST)

    def times(self, left: Value, right: Value) -> Value:
        """Returns the product."""
        return self.builder.fmul(left, right, flags=FAST)

    def over(self, left: Value, right: Value) -> Value:
        """Returns the quotient."""
        return self.builder.fdiv(left, right, flags=FAST)

    def negative(self, value: Value) -> Value:
        """Returns the number with its sign changed."""
        return self.builder.fneg(value)

    def fused(self, left: Value, right: Value, rest: Value) -> Value:
        """Returns ``left right + rest``."""
        return self._intrinsic("fmuladd", left, right, rest)

    def root(self, value: Value) -> Value:
        """Returns the square root."""
        return self._intrinsic("sqrt", value)

    def smaller(self, left: Value, right: Value) -> Value:
        """Returns the smaller number of each frame."""
        return self.builder.select(self.builder.fcmp_ordered("<", left, right), left, right)

    def larger(self, left: Value, right: Value) -> Value:
        """Returns the larger number of each frame."""
        return self.builder.select(self.builder.fcmp_ordered(">", left, right), left, right)

    def _intrinsic(self, name: str, *values: Value) -> Value:
        full = f"llvm.{name}.v{LANES}f64"
        if full not in self.module.globals:
            kind = ir.FunctionType(VECTOR, [VECTOR] * len(values))
            ir.Function(self.module, kind, full)
        return self.builder.call(self.module.globals[full], values)

    def dot(self, left: Sequence[Value], right: Sequence[Value], rest: Value = None) -> Value:
        """Returns the sum of products, and of what is there already."""
        total = rest
        for a, b in zip(left, right, strict=True):
            total = self.times(a, b) if total is None else self.fused(a, b, total)
        return total

    def cross(self, left: Sequence[Value], right: Sequence[Value]) -> list[Value]:
        """Returns the cross product of two vectors of three."""
        return [
            self.subtract(self.times(left[j], right[k]), self.times(left[k], right[j]))
            for j, k in ((1, 2), (2, 0), (0, 1))
        ]

    @contextmanager
    def loop(self, start: Slot, stop: Slot) -> Iterator[Value]:
        """Repeats what is written inside for every whole number from ``start`` to before ``stop``.

        A context manager's body is written once and runs as often as the numbers say.
        """
        first = constant(start) if isinstance(start, int) else start
        last = constant(stop) if isinstance(stop, int) else stop
        head = self.function.append_basic_block()
        body = self.function.append_basic_block()
        end = self.function.append_basic_block()
        before = self.builder.block
        self.builder.branch(head)
        self.builder.position_at_end(head)
        index = self.builder.phi(LONG)
        index.add_incoming(first, before)
        self.builder.cbranch(self.builder.icmp_signed("<", index, last), body, end)
        self.builder.position_at_end(body)
        yield index
        index.add_incoming(self.builder.add(index, constant(1)), self.builder.block)
        self.builder.branch(head)
        self.builder.position_at_end(end)

    @contextmanager
    def when(self, condition: Value) -> Iterator[None]:
        """Runs what is written inside only if a whole number is not zero."""
        with self.builder.if_then(self.builder.icmp_signed("!=", condition, constant(0))):
            yield
