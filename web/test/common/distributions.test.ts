import { describe, expect, it } from "vitest";

import { atLeast, meanOverTime, quantile } from "../../src/common/distributions";

const FAIR = Array.from({ length: 6 }, () => 1 / 6);

describe("atLeast", () => {
  it("sums the upper tail", () => {
    expect(atLeast(FAIR, 5)).toBeCloseTo(2 / 6);
    expect(atLeast(FAIR, 1)).toBeCloseTo(1);
    expect(atLeast(FAIR, 7)).toBe(0);
  });

  it("falls as the score rises and complements the quantile", () => {
    const pmf = [0.05, 0.2, 0.4, 0.3, 0.05];
    for (let score = 1; score < 5; score++) {
      expect(atLeast(pmf, score)).toBeGreaterThanOrEqual(atLeast(pmf, score + 1));
    }
    for (const p of [0.01, 0.3, 0.5, 0.9]) {
      const q = quantile(pmf, p);
      expect(1 - atLeast(pmf, q + 1)).toBeGreaterThanOrEqual(p - 1e-9);
      expect(1 - atLeast(pmf, q)).toBeLessThan(p);
    }
  });
});

describe("quantile", () => {
  it("is a score that reaches the probability, exactly at a step", () => {
    expect(quantile(FAIR, 0.5)).toBe(3);
    expect(quantile(FAIR, 0.51)).toBe(4);
    expect(quantile([0, 1], 0.05)).toBe(2);
    expect(quantile([0, 0, 1], 0.95, 0)).toBe(2);
  });
});

describe("meanOverTime", () => {
  it("weighs by time, not by number of samples", () => {
    expect(meanOverTime([0, 1, 1.001, 1.002, 1.003], [2, 2, 2, 2, 2])).toBeCloseTo(2);
    expect(meanOverTime([0, 3, 4], [0, 0, 2])).toBeCloseTo(1 / 4);
  });

  it("gives the one value of one sample", () => {
    expect(meanOverTime([5], [4])).toBe(4);
  });
});
