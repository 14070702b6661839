import { describe, expect, it } from "vitest";

import { peakEffort, ranked, shareAtFive, verdictOf } from "../../src/common/verdict";
import type { Assessment, Candidate } from "../../src/data/types";

function candidate(id: string, rank: number | null, more: Partial<Candidate> = {}): Candidate {
  const time_s = [0, 1, 2];
  return {
    id,
    rank,
    p_best: rank === 1 ? 0.78 : 0.1,
    tied_with: [],
    cost: {
      total: 0.5 * (rank ?? 1),
      parts: [
        {
          name: "rula",
          value: 3 + (rank ?? 0),
          unit: "score",
          weight: 0.1,
          contribution: 0.1 * (rank ?? 0),
        },
        { name: "back", value: 10, unit: "deg", weight: 0.01, contribution: 0.1 },
      ],
    },
    rula: {
      time_s,
      pmf: time_s.map(() => [0, 0, 0.5, 0, 0, 0.5, 0]),
      expected: [4.5, 4.5, 4.5],
      p05: [3, 3, 3],
      p95: [6, 6, 6],
    },
    reba: null,
    back_angle_deg: null,
    effort_nm: {
      jRightElbow: { p05: [1, 1, 1], p50: [2, 8, 2], p95: [3, 9, 3] },
      jL5S1: { p05: [9, 9, 9], p50: [20, 41, 20], p95: [30, 50, 30] },
    },
    worst: null,
    moments: [],
    assumed: [],
    out_of_distribution: null,
    baseline: null,
    problem: null,
    ...more,
  };
}

const faulty = candidate("bad", null, {
  p_best: null,
  problem: { type: "/problems/unreachable", title: "Out of reach", status: 422 },
});

const of = (...candidates: Candidate[]): Assessment => ({
  id: "a",
  model_id: "m",
  created: "",
  seed: 0,
  samples: 100,
  methods: [],
  cost_definition: null,
  candidates,
});

describe("verdictOf", () => {
  it("names the winner, how sure it is, and the part of the cost that decides", () => {
    const verdict = verdictOf(of(candidate("B", 2), candidate("A", 1)));
    expect(verdict.take).toEqual(["A"]);
    expect(verdict.headline).toBe("Take A: least load, 78 % sure");
    expect(verdict.reasons.join(" ")).toContain("What decides over B: RULA 4.00 against 5.00");
    expect(verdict.reasons.join(" ")).toContain("low back (L5–S1), 41.0 N·m");
  });

  it("does not feign a winner where two are tied", () => {
    const verdict = verdictOf(
      of(candidate("A", 1, { tied_with: ["B"] }), candidate("B", 2), candidate("C", 3)),
    );
    expect(verdict.take).toEqual(["A", "B"]);
    expect(verdict.headline).toBe("Take A or B: nothing tells them apart");
    expect(verdict.reasons[0]).toContain("over C");
  });

  it("counts what could not be assessed and says so when that is all", () => {
    expect(verdictOf(of(faulty, candidate("A", 1), candidate("B", 2))).reasons.at(-1)).toBe(
      "1 of 3 could not be assessed.",
    );
    expect(verdictOf(of(faulty, candidate("A", 1))).headline).toBe("Only A can be assessed");
    expect(verdictOf(of(faulty)).take).toEqual([]);
  });

  it("warns of a winner that the model has not seen the like of", () => {
    const strange = { flag: true, familiarity_min: 0.01, time_s: 1 };
    const verdict = verdictOf(
      of(candidate("A", 1, { out_of_distribution: strange }), candidate("B", 2)),
    );
    expect(verdict.reasons.join(" ")).toContain("trust it less");
  });
});

it("ranked puts the faulty last and leaves the order sent alone", () => {
  const sent = [faulty, candidate("B", 2), candidate("A", 1)];
  expect(ranked(sent).map((item) => item.id)).toEqual(["A", "B", "bad"]);
  expect(sent[0]).toBe(faulty);
});

it("shareAtFive falls back on the distribution", () => {
  expect(shareAtFive(candidate("A", 1))).toBeCloseTo(0.5);
});

it("peakEffort is the largest median over joints and times", () => {
  expect(peakEffort(candidate("A", 1))).toEqual({ joint: "jL5S1", effort: 41 });
  expect(peakEffort(candidate("A", 1, { effort_nm: null }))).toBeNull();
});
