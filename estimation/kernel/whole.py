"""The whole kernel: all passes over all frames, eight at a time."""

from collections.abc import Sequence

from llvmlite import ir

from estimation.kernel.block_products import Blocks
from estimation.kernel.lanes import write_gather, write_scatter
from estimation.kernel.layout import COMMON, LANES, MEANS, NAME, SETTING, SPREADS, TABLE
from estimation.kernel.site_pairs import write_pair
from estimation.kernel.vector_code import LONG, POINTER, Code, Value, constant, splat
from estimation.kernel.way_down import write_link_out, write_means, write_spreads
from estimation.kernel.way_out import write_base, write_place, write_terms
from estimation.kernel.way_up import write_eliminate, write_root


def kernel_code(wide_registers: bool) -> str:
    """Returns the kernel in LLVM's language.

    Args:
        wide_registers: whether the processor has 32 registers that hold eight numbers each.
    """
    module = ir.Module("kernel")
    blocks = Blocks(module, rows_at_once=2 if wide_registers else 1)
    base, place, terms = write_base(blocks), write_place(blocks), write_terms(blocks)
    eliminate, root = write_eliminate(blocks), write_root(blocks)
    means, spreads = write_means(blocks), write_spreads(blocks)
    link_out, pair = write_link_out(blocks), write_pair(blocks)
    gather, scatter = write_gather(blocks), write_scatter(blocks)
    code = Code(module, NAME, [POINTER, LONG])
    tables, count = code.arguments
    builder = code.builder
    work, rows = code.entry(tables, TABLE["work"]), code.entry(tables, TABLE["rows"])
    settings = code.entry(tables, TABLE["settings"])
    links = code.whole(settings, SETTING["n_links"])
    batches = builder.sdiv(builder.add(count, constant(LANES - 1)), constant(LANES))
    zero, one = constant(0), constant(1)
    final = builder.sub(count, one)

    def put_out(name: str) -> None:
        start = code.whole(settings, SETTING[f"start of {name}"])
        size = code.whole(settings, SETTING[f"size of {name}"])
        out = code.entry(tables, TABLE[name])
        builder.call(scatter, [out, rows, size, code.at(work, start)])

    with code.loop(0, batches) as batch:
        first = builder.mul(batch, constant(LANES))
        for lane in range(LANES):
            # The last frame fills up the last batch; it comes out the same each time.
            frame = builder.add(first, constant(lane))
            beyond = builder.icmp_signed(">", frame, final)
            frame = builder.select(beyond, final, frame)
            builder.store(frame, builder.gep(rows, [constant(lane)], source_etype=LONG), align=8)
        code.store(splat(float("inf")), work, COMMON["least"])
        builder.call(gather, [tables])
        builder.call(base, [tables, zero])
        builder.call(terms, [tables, zero])
        with code.loop(1, links) as link:
            builder.call(place, [tables, link])
            builder.call(terms, [tables, link])
        with code.loop(1, links) as step:
            builder.call(eliminate, [tables, builder.sub(links, step)])
        builder.call(root, [tables, zero])
        with code.loop(1, links) as link:
            builder.call(means, [tables, link])
        with code.when(code.whole(settings, SETTING["spreads"])):
            with code.loop(1, links) as link:
                builder.call(spreads, [tables, link])
            with code.loop(0, code.whole(settings, SETTING["n_pairs"])) as which:
                builder.call(pair, [tables, which])
        with code.loop(0, links) as link:
            builder.call(link_out, [tables, link])
        with code.when(code.whole(settings, SETTING["spreads"])):
            _spoil(code, work, settings, SPREADS)
        _spoil(code, work, settings, MEANS[:-1])
        start = code.whole(settings, SETTING["start of status"])
        least = code.load(work, COMMON["least"])
        code.store(least, code.at(work, builder.add(start, constant(2))))
        for name in MEANS:
            put_out(name)
        with code.when(code.whole(settings, SETTING["spreads"])):
            for name in SPREADS:
                put_out(name)
    code.done()
    return str(module)


def _spoil(code: Code, work: Value, settings: Value, names: Sequence[str]) -> None:
    """Makes the least of what must be positive no number where one of these results is none."""
    first = code.whole(settings, SETTING[f"start of {names[0]}"])
    start = code.whole(settings, SETTING[f"start of {names[-1]}"])
    size = code.whole(settings, SETTING[f"size of {names[-1]}"])
    least = code.at(work, COMMON["least"])
    with code.loop(first, code.builder.add(start, size)) as slot:
        nothing = code.times(code.load(work, slot), splat(0.0))
        code.store(code.add(code.load(least), nothing), least)
