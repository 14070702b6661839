"""In and out of working memory: rows of eight frames become vectors of eight frames, and back."""

from typing import Any

from llvmlite import ir

from estimation.kernel.block_products import Blocks
from estimation.kernel.layout import LANES, SETTING, TABLE
from estimation.kernel.vector_code import LONG, POINTER, VECTOR, Code, Value, constant


def write_gather(blocks: Blocks) -> Any:
    """Writes the function that brings the rows of eight frames into working memory."""
    code = _start(blocks, "gather", [POINTER])
    (tables,) = code.arguments
    rows, frames = code.entry(tables, TABLE["rows"]), code.entry(tables, TABLE["frames"])
    settings = code.entry(tables, TABLE["settings"])
    width = code.whole(settings, SETTING["width"])
    first = code.whole(settings, SETTING["row_start"])
    out = code.at(code.entry(tables, TABLE["work"]), first)
    starts = [_row(code, frames, rows, lane, width) for lane in range(LANES)]
    with code.loop(0, code.builder.sdiv(width, constant(LANES))) as group:
        column = code.builder.mul(group, constant(LANES))
        given = [
            code.builder.load(code.number(start, column), typ=VECTOR, align=8) for start in starts
        ]
        code.stores(_turned(code, given), code.at(out, column))
    return code.done()


def write_scatter(blocks: Blocks) -> Any:
    """Writes the function that puts slots out: ``width`` numbers into each frame's own row."""
    code = _start(blocks, "scatter", [POINTER, POINTER, LONG, POINTER])
    out, rows, width, block = code.arguments
    starts = [_row(code, out, rows, lane, width) for lane in range(LANES)]
    groups = code.builder.sdiv(width, constant(LANES))
    with code.loop(0, groups) as group:
        column = code.builder.mul(group, constant(LANES))
        found = _turned(code, code.loads(code.at(block, column), LANES))
        for start, row in zip(starts, found, strict=True):
            code.builder.store(row, code.number(start, column), align=8)
    with code.loop(code.builder.mul(groups, constant(LANES)), width) as slot:
        first = code.builder.mul(slot, constant(LANES))
        for lane, start in enumerate(starts):
            number = code.real(block, code.builder.add(first, constant(lane)))
            code.builder.store(number, code.number(start, slot), align=8)
    return code.done()


def _start(blocks: Blocks, name: str, arguments: list[Any]) -> Code:
    code = Code(blocks.module, name, arguments)
    code.function.linkage = "internal"
    code.function.attributes.add("noinline")
    return code


def _row(code: Code, table: Value, rows: Value, lane: int, width: Value) -> Value:
    return code.number(table, code.builder.mul(code.whole(rows, lane), width))


def _turned(code: Code, rows: list[Value]) -> list[Value]:
    """Transposes eight vectors of eight: blocks of one, two and four trade places in turn."""
    rows = list(rows)
    kind = ir.VectorType(ir.IntType(32), LANES)
    size = 1
    while size < LANES:
        lanes = range(LANES)
        low = [lane + LANES - size if lane & size else lane for lane in lanes]
        high = [lane + LANES if lane & size else lane + size for lane in lanes]
        for first in (row for row in range(LANES) if not row & size):
            a, b = rows[first], rows[first + size]
            rows[first] = code.builder.shuffle_vector(a, b, ir.Constant(kind, low))
            rows[first + size] = code.builder.shuffle_vector(a, b, ir.Constant(kind, high))
        size *= 2
    return rows
