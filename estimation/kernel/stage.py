"""What every stage of the kernel starts from: one link, and ways to reach numbers."""

from typing import Any

from estimation.kernel.block_products import Blocks
from estimation.kernel.layout import (
    COMMON,
    COMMON_SLOTS,
    GLOBAL_SIZE,
    LINK_CONSTANTS,
    LINK_CONSTANTS_SIZE,
    LINK_ROW,
    LINK_ROW_SIZE,
    LINK_SLOTS,
    SETTING,
    SLOT,
    TABLE,
)
from estimation.kernel.vector_code import (
    LONG,
    POINTER,
    Code,
    Slot,
    Value,
    constant,
    splat,
)


class Stage(Code):
    """A function of the kernel for one link; its arguments are the table of tables and the link."""

    def __init__(self, blocks: Blocks, name: str, more: int = 0) -> None:
        """Starts the stage ``name`` with ``more`` whole numbers as further arguments."""
        super().__init__(blocks.module, name, [POINTER, LONG] + [LONG] * more)
        self.function.linkage = "internal"
        self.function.attributes.add("noinline")
        self.blocks = blocks
        self.tables, self.link = self.arguments[:2]
        self.work = self.table("work")
        self.row = self.address("links", self.link, LINK_ROW_SIZE)

    def table(self, name: str) -> Value:
        """Returns the address of a table."""
        return self.entry(self.tables, TABLE[name])

    def address(self, name: str, row: Value, size: int) -> Value:
        """Returns the address of a row of a table of whole numbers."""
        index = self.builder.mul(row, constant(size))
        return self._address(self.table(name), index, LONG)

    def setting(self, name: str) -> Value:
        """Reads a whole number of the run."""
        return self.whole(self.table("settings"), SETTING[name])

    def of_link(self, name: str) -> Value:
        """Reads a whole number of this link."""
        return self.whole(self.row, LINK_ROW[name])

    def block(self, name: str, link: Value | None = None) -> Value:
        """Returns the address of one of a link's blocks; of this link's if none is named."""
        index = self.builder.mul(self.link if link is None else link, constant(LINK_SLOTS))
        return self.at(self.work, self.builder.add(index, constant(COMMON_SLOTS + SLOT[name])))

    def common(self, name: str) -> Value:
        """Returns the address of working memory that no link owns."""
        return self.at(self.work, COMMON[name])

    def link_constant(self, name: str) -> Value:
        """Returns where a link's constants start, for `real`."""
        index = self.builder.mul(self.link, constant(LINK_CONSTANTS_SIZE))
        first = self.builder.add(index, constant(GLOBAL_SIZE + LINK_CONSTANTS[name]))
        return self.number(self.table("constants"), first)

    def spread_all(self, numbers: Value, out: Value, count: int) -> None:
        """Gives every frame the same ``count`` numbers."""
        with self.loop(0, count) as slot:
            self.store(self.spread(self.real(numbers, slot)), out, slot)

    def fill(self, value: Value, out: Value, count: int) -> None:
        """Writes one value into ``count`` slots."""
        with self.loop(0, count) as slot:
            self.store(value, out, slot)

    def copy(self, out: Value, block: Value, count: int) -> None:
        """Copies ``count`` slots."""
        with self.loop(0, count) as slot:
            self.store(self.load(block, slot), out, slot)

    def fetch(self, out: Value, reference: Value, count: Slot) -> None:
        """Reads numbers by reference: the same of all frames, or of each frame its own."""
        name = "fetch"
        if name not in self.module.globals:
            _write_fetch(self.blocks, name)
        number = constant(count) if isinstance(count, int) else count
        self.builder.call(self.module.globals[name], [self.tables, out, reference, number])

    def own(self, column: Slot) -> Value:
        """Returns where a column of the frames' own rows stands in working memory."""
        first = self.setting("row_start")
        number = constant(column) if isinstance(column, int) else column
        return self.at(self.work, self.builder.add(first, number))

    def output(self, name: str, column: Slot = 0) -> Value:
        """Returns where a result is gathered before it goes out, from a column on."""
        first = self.setting(f"start of {name}")
        number = constant(column) if isinstance(column, int) else column
        return self.at(self.work, self.builder.add(first, number))

    def standard_deviations(self, out: Value, variances: list[Value]) -> None:
        """Writes square roots, and remembers the least of what they are taken of."""
        least = self.load(self.common("least"))
        for slot, variance in enumerate(variances):
            least = self.smaller(variance, least)
            # What is no number stays none.
            self.store(self.root(self.larger(splat(0.0), variance)), out, slot)
        self.store(least, self.common("least"))


def _write_fetch(blocks: Blocks, name: str) -> Any:
    code = Code(blocks.module, name, [POINTER, POINTER, LONG, LONG])
    code.function.linkage = "internal"
    code.function.attributes.add("noinline")
    tables, out, reference, count = code.arguments

    def table(which: str) -> Value:
        return code.entry(tables, TABLE[which])

    with code.builder.if_else(code.builder.icmp_signed(">=", reference, constant(0))) as (
        same,
        own,
    ):
        with same:
            numbers = code.number(table("constants"), reference)
            with code.loop(0, count) as slot:
                code.store(code.spread(code.real(numbers, slot)), out, slot)
        with own:
            column = code.builder.sub(constant(-1), reference)
            first = code.whole(table("settings"), SETTING["row_start"])
            given = code.at(table("work"), code.builder.add(first, column))
            with code.loop(0, count) as slot:
                code.store(code.load(given, slot), out, slot)
    return code.done()
