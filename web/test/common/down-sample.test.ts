import { describe, expect, it } from "vitest";

import { keepExtremes } from "../../src/common/down-sample";

describe("keepExtremes", () => {
  it("keeps a peak of one frame among a hundred thousand", () => {
    const values = new Float64Array(100_000).fill(1);
    values[31_337] = 9;
    values[70_001] = -9;
    const kept = keepExtremes([values], 500);
    expect(kept).toContain(31_337);
    expect(kept).toContain(70_001);
    expect(kept.length).toBeLessThanOrEqual(2 * 500 + 2);
  });

  it("keeps the extremes of every column, the ends, and the order", () => {
    const a = Array.from({ length: 5000 }, (_, i) => Math.sin(i / 7));
    const b = Array.from({ length: 5000 }, (_, i) => (i === 4321 ? 5 : 0));
    const kept = keepExtremes([a, b], 50);
    expect(kept[0]).toBe(0);
    expect(kept[kept.length - 1]).toBe(4999);
    expect(kept).toContain(4321);
    expect(kept).toEqual([...new Set(kept)].sort((x, y) => x - y));
    expect(Math.max(...kept.map((i) => a[i]!))).toBe(Math.max(...a));
  });

  it("leaves short series whole", () => {
    expect(keepExtremes([[3, 1, 2]], 100)).toEqual([0, 1, 2]);
    expect(keepExtremes([[]], 100)).toEqual([]);
  });
});
