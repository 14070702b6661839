"""The last pass: covariances between the external wrenches on the free sites.

The same as `cross_covariance` does with numpy: each wrench is written in the acceleration and the
multiplier of the link where the two paths to the base meet.
"""

from typing import Any

from estimation.kernel.block_products import SIX, Blocks
from estimation.kernel.layout import PAIR_ROW, PAIR_ROW_SIZE
from estimation.kernel.stage import Stage
from estimation.kernel.vector_code import LONG, Value, constant, splat


def write_pair(blocks: Blocks) -> Any:
    """Writes the stage for one pair of sites, whose row stands in the place of a link."""
    stage = Stage(blocks, "pair")
    row = stage.address("sites", stage.link, PAIR_ROW_SIZE)
    number = {name: stage.whole(row, place) for name, place in PAIR_ROW.items()}
    a1, z1, a2, z2, T1, T2 = (stage.common(f"block{place}") for place in range(6))
    out, flipped, prior = a2, z2, stage.common("block6")
    pulled = stage.setting("prior_on_joint_wrenches")
    with stage.when(pulled):
        for a, z, name in ((a1, z1, "first"), (a2, z2, "second")):
            start = PAIR_ROW[f"{name}_path"]
            ends = (stage.whole(row, start), stage.whole(row, start + 1))
            _move(stage, a, z, number[name], *ends)
        Ca, Caz, B = (stage.block(name, number["meeting"]) for name in ("Ca", "Caz", "B"))
        blocks.product(stage, T1, Ca, a2, right_turned=True)
        blocks.product(stage, T1, Caz, z2, right_turned=True, add=True)
        blocks.product(stage, T2, Caz, a2, left_turned=True, right_turned=True)
        blocks.product(stage, T2, B, z2, right_turned=True, add=True)
        blocks.product(stage, out, a1, T1)
        blocks.product(stage, out, z1, T2, add=True)
    with stage.when(stage.builder.sub(constant(1), pulled)):
        for through, name in ((T1, "first"), (T2, "second")):
            link = number[name]
            blocks.product(stage, through, stage.block("Px", link), stage.block("F", link))
        blocks.product(stage, out, T1, T2, right_turned=True, minus=True)
    same = stage.builder.icmp_signed("==", number["row"], number["column"])
    with stage.builder.if_then(same):
        stage.copy(prior, stage.block("Px", number["first"]), 36)
        _put_block(stage, "site_prior", number["row"], number["column"], prior)
        blocks.sum(stage, T1, out, prior)
        stage.copy(out, T1, 36)
    with stage.builder.if_then(stage.builder.not_(same)):
        # Beforehand nothing ties one site to another.
        stage.fill(splat(0.0), prior, 36)
        _put_block(stage, "site_prior", number["row"], number["column"], prior)
        _put_block(stage, "site_prior", number["column"], number["row"], prior)
    _put_block(stage, "site_covariance", number["row"], number["column"], out)
    for i in SIX:
        for j in SIX:
            stage.store(stage.load(out, 6 * i + j), flipped, 6 * j + i)
    _put_block(stage, "site_covariance", number["column"], number["row"], flipped)
    return stage.done()


def _move(stage: Stage, a: Value, z: Value, link: Value, first: Value, last: Value) -> None:
    """Writes a link's external wrench in an ancestor's acceleration and multiplier.

    Only a prior on joint wrenches makes this necessary: without one a wrench is ``-Px F`` times
    the same six unknowns for all links.
    """
    blocks, builder = stage.blocks, stage.builder
    w, rest, X, onward = (stage.common(f"block{place}") for place in range(6, 10))
    stage.fill(splat(0.0), a, 36)
    Px = stage.block("Px", link)
    with stage.loop(0, 36) as slot:
        stage.store(stage.negative(stage.load(Px, slot)), z, slot)
    paths = stage.table("paths")
    with stage.loop(first, last) as step:
        address = builder.gep(paths, [step], source_etype=LONG)
        here = stage.whole(address)
        blocks.transform(stage, X, stage.block("turn", here), stage.block("offset", here))
        stage.copy(w, z, 36)
        blocks.product(stage, w, a, stage.block("G", here), add=True)
        blocks.product(stage, rest, a, stage.block("A", here))
        U, through = stage.block("U", here), stage.block("through", here)
        blocks.product(stage, rest, w, U, add=True, minus=True)
        blocks.product(stage, onward, w, through)
        blocks.product(stage, a, rest, X)
        blocks.product(stage, z, onward, X)


def _put_block(stage: Stage, table: str, row: Value, column: Value, block: Value) -> None:
    builder = stage.builder
    side = builder.mul(stage.setting("n_sites"), constant(6))
    across = builder.mul(column, constant(6))
    for i in SIX:
        down = builder.add(builder.mul(row, constant(6)), constant(i))
        start = builder.add(builder.mul(down, side), across)
        stage.copy(stage.output(table, start), stage.at(block, 6 * i), 6)
