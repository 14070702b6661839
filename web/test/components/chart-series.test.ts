import { describe, expect, it } from "vitest";

import { resample, unionOfTimes } from "../../src/common/align-series";
import { chartData } from "../../src/components/chart-series";
import { baselineRows } from "../../src/components/baseline-rows";
import type { Candidate } from "../../src/data/types";

describe("aligning", () => {
  it("merges times without repeats", () => {
    expect(unionOfTimes([[0, 1, 2], [0.5, 1], []])).toEqual([0, 0.5, 1, 2]);
  });

  it("draws nothing past the end of a series", () => {
    expect(resample({ times: [0, 1], values: [0, 10] }, [-1, 0, 0.25, 1, 2])).toEqual([
      null,
      0,
      2.5,
      10,
      null,
    ]);
  });
});

describe("chartData", () => {
  const line = { label: "a", times: [0, 1, 2], values: [1, 2, 3], kind: "main" as const };

  it("puts the band's edges first, high before low, over one time axis", () => {
    const other = { label: "b", times: [0, 0.5], values: [4, 4], kind: "compare" as const };
    const range = { label: "r", times: [0, 1, 2], low: [0, 0, 0], high: [9, 9, 9] };
    const { lines, columns } = chartData([other, line], range);
    expect(lines.map((item) => item.kind)).toEqual(["edge", "edge", "compare", "main"]);
    expect(columns).toEqual([
      [0, 0.5, 1, 2],
      [9, 9, 9, 9],
      [0, 0, 0, 0],
      [4, 4, null, null],
      [1, 1.5, 2, 3],
    ]);
  });

  it("thins long series without losing their peak", () => {
    const times = Array.from({ length: 50_000 }, (_, i) => i / 240);
    const values = times.map((_, i) => (i === 12_345 ? 7 : 2));
    const { columns } = chartData([{ ...line, times, values }], null, 300);
    expect(columns[0].length).toBeLessThan(1000);
    expect(Math.max(...(columns[1] as number[]))).toBe(7);
  });
});

describe("baselineRows", () => {
  const candidate = (id: string, rank: number, ours: number, theirs: number) =>
    ({
      id,
      rank,
      cost: { total: ours, parts: [] },
      rula: null,
      baseline: { "min-norm": { cost_total: theirs, rula_expected_mean: 4 } },
    }) as unknown as Candidate;

  it("tells which candidate each method would take", () => {
    const rows = baselineRows([candidate("A", 1, 1, 9), candidate("B", 2, 2, 3)], "A", "mi-nsgp");
    expect(rows.map(({ method, pick, cost }) => [method, pick, cost])).toEqual([
      ["mi-nsgp", "A", 1],
      ["min-norm", "B", 9],
    ]);
  });
});
