import { expect, it } from "vitest";

import { inspectionWords } from "../../src/common/inspection-words";
import { heldOutRows } from "../../src/components/held-out-rows";

it("inspectionWords says what was read and what was done to it, findings first", () => {
  const inspection = {
    rate_hz: 59.999,
    duration_s: 10.48,
    frames: 630,
    problems: [{ code: "sides", severity: "warning", message: "Sides may be swapped." }],
    notes: [{ message: "Frame 0 is a reference pose." }],
    conversions: ["lengths from cm to m"],
  };
  expect(inspectionWords(inspection)).toEqual({
    facts: "60 Hz, 10.5 s, 630 frames",
    notes: ["Sides may be swapped.", "Frame 0 is a reference pose.", "lengths from cm to m"],
  });
  expect(inspectionWords({})).toEqual({ facts: "", notes: [] });
});

it("heldOutRows leaves out what a model's file does not tell", () => {
  const scores = [
    { method: "mi-nsgp", rollout_rmse_deg: 0.7, coverage90_rollout: 0.89 },
    { method: "cov-ik", rollout_rmse_deg: null },
    { nonsense: 1 },
    null,
  ];
  expect(heldOutRows({ scores })).toEqual([
    { method: "mi-nsgp", errorDeg: 0.7, coverage: 0.89 },
    { method: "cov-ik", errorDeg: null, coverage: null },
  ]);
  expect(heldOutRows({})).toEqual([]);
  expect(heldOutRows(null)).toEqual([]);
});
