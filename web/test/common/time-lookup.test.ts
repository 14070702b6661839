import { describe, expect, it } from "vitest";

import { nearestValue, placeOf, valueAt } from "../../src/common/time-lookup";

const TIMES = [0, 0.1, 0.4, 1];

describe("placeOf", () => {
  it("finds the sample before a time and how far it is to the next", () => {
    expect(placeOf(TIMES, 0.25)).toEqual({ index: 1, fraction: expect.closeTo(0.5) });
    expect(placeOf(TIMES, 0.4)).toEqual({ index: 2, fraction: 0 });
  });

  it("clamps times outside, and what is no time, to the ends", () => {
    expect(placeOf(TIMES, -3)).toEqual({ index: 0, fraction: 0 });
    expect(placeOf(TIMES, Number.NaN)).toEqual({ index: 0, fraction: 0 });
    expect(placeOf(TIMES, 9)).toEqual({ index: 3, fraction: 0 });
    expect(placeOf([5], 9)).toEqual({ index: 0, fraction: 0 });
  });

  it("agrees with a search from the front at many times", () => {
    const times = Array.from({ length: 200 }, (_, i) => i * 0.01 + 0.003 * Math.sin(i));
    for (let time = 0; time < 2; time += 0.0137) {
      let index = times.findLastIndex((t) => t <= time);
      index = Math.max(0, index);
      expect(placeOf(times, time).index).toBe(index);
    }
  });

  it("refuses to look into nothing", () => {
    expect(() => placeOf([], 0)).toThrow(/no times/);
  });
});

it("valueAt is exact on a straight line, however unevenly it is sampled", () => {
  const values = TIMES.map((time) => 3 - 2 * time);
  for (const time of [0, 0.05, 0.3, 0.77, 1])
    expect(valueAt(TIMES, values, time)).toBeCloseTo(3 - 2 * time);
});

it("nearestValue gives a score that occurred, never one between two", () => {
  expect(nearestValue(TIMES, [2, 5, 3, 7], 0.04)).toBe(2);
  expect(nearestValue(TIMES, [2, 5, 3, 7], 0.06)).toBe(5);
  expect(nearestValue(TIMES, [2, 5, 3, 7], 1)).toBe(7);
});
