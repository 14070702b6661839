import { describe, expect, it } from "vitest";

import { resample } from "../../src/common/align-series";
import { keepExtremes } from "../../src/common/down-sample";
import { estimateOptions } from "../../src/common/estimate-request";
import {
  course,
  numbers,
  plottedColumns,
  postureOf,
  shadesOf,
  sizeCourse,
  stretches,
  withGaps,
} from "../../src/common/estimate-series";
import {
  balanceWords,
  facts,
  headline,
  kilograms,
  splitWords,
  stanceWords,
} from "../../src/common/estimate-words";
import { formatRoute, parseRoute } from "../../src/common/route";
import type { EstimateSummary, Hold } from "../../src/data/estimate-types";

const band = (p50: number, half = 1) => ({ p05: p50 - half, p50, p95: p50 + half });

const hold = (
  start: number,
  state: Hold["state"],
  mass: number,
  more: Partial<Hold> = {},
): Hold => ({
  start_s: start,
  end_s: start + 1,
  state,
  hands: ["right", "left"],
  mass_kg: band(mass),
  by_definition_kg: { inertial: band(mass) },
  split_kg: null,
  ...more,
});

const estimate = (more: Partial<EstimateSummary> = {}): EstimateSummary =>
  ({
    source: "lift.trc",
    options: { tare_s: null },
    person: { mass_kg: 72, model_mass_kg: 72 },
    duration_s: 7,
    frames: 350,
    rate_hz: 50,
    left_out: {},
    bands: "noise_and_model",
    payload: {
      definition: "inertial",
      free_hands: ["right", "left"],
      known_share: 1,
      max_kg: null,
      plates_minus_model_kg: band(-0.5),
    },
    holds: [hold(0, "free", 0), hold(1, "loaded", 2), hold(3, "loaded", 5)],
    efforts: [{ joint: "jL5S1", peak_nm: band(40), at_s: 1 }],
    balance: { share: { known: 0.9, unknown: 0.1 }, stretches: [] },
    feet: { plates_from: "a", clock: null, stances: [] },
    columns: [],
    ...more,
  }) as unknown as EstimateSummary;

describe("the answer in words", () => {
  const payload = estimate().payload;
  it.each([
    [{}, "5.00 kg (4.00 to 6.00) in the hands from 3.0 s to 4.0 s, the most of 2 holds"],
    [{ holds: [hold(0, "free", 0)] }, "The hands carry nothing that shows"],
    [{ holds: [] }, "Nowhere is a load held long enough to be weighed"],
    [{ payload: { ...payload, known_share: 0 } }, "What the hands carry cannot be told"],
    [
      { payload: { ...payload, free_hands: [] } },
      "What the body bears with empty hands: most at the low back (L5–S1), 40.0 N·m",
    ],
  ])("%#", (more, text) => expect(headline(estimate(more as Partial<EstimateSummary>))).toBe(text));

  it("says which way the plates differ, and that nothing was tared", () => {
    const text = facts(estimate()).join(" ");
    expect(text).toContain("0.50 kg less than the body’s 72.0 kg (-1.50 to +0.50 over the frames)");
    expect(text).toContain("No tare was given");
    const tared = estimate({
      options: { tare_s: [0, 1] },
      person: { ...estimate().person, model_mass_kg: 73.2 },
    });
    expect(facts(tared).join(" ")).toContain("73.2 kg after the tare");
    expect(facts(tared).join(" ")).not.toContain("No tare");
  });

  it("never calls bands that are tuning or absent uncertainty", () => {
    expect(facts(estimate({ bands: "tuning" })).join(" ")).toContain("too narrow to be believed");
    expect(kilograms({ p05: null, p50: 2, p95: null })).toBe("2.00 kg");
    expect(kilograms(band(-0.001, 0.5))).toBe("0.00 kg (-0.50 to 0.50)");
  });

  it("makes up no share between two hands", () => {
    expect(splitWords(hold(0, "loaded", 5))).toBe("only the sum can be told");
    expect(splitWords(hold(0, "free", 0))).toBe("");
    expect(splitWords(hold(0, "loaded", 5, { hands: ["right"] }))).toBe("right hand alone");
    const split = { split_kg: { right: 2, left: 3 } };
    expect(splitWords(hold(0, "loaded", 5, split))).toBe("right 2.00 kg, left 3.00 kg");
  });

  it("gathers each foot's stances", () => {
    const stance = { plate: "1", foot: "right", given: false };
    const stances = [
      { ...stance, start_s: 0, end_s: 0.68 },
      { ...stance, start_s: 1.07, end_s: 1.3 },
    ];
    const feet = { plates_from: "a", clock: null, stances };
    expect(stanceWords(estimate({ feet }))).toEqual(["Plate 1, right foot: 0.0–0.7 s, 1.1–1.3 s"]);
    expect(balanceWords(estimate())).toBe("Balance known 90 %, not known 10 % of the time");
  });
});

describe("the series", () => {
  const columns = {
    time_s: [0, 1, 2, 3, 4],
    doubtful: [false, true, false, false, false],
    payload_p05_kg: [0, 1, null, null, 4],
    payload_p50_kg: [1, 2, null, null, 5],
    payload_p95_kg: [2, 3, null, null, 6],
  };

  it("keeps what cannot be told apart from zero", () => {
    const of = course(columns, "payload", "kg");
    expect(of.middle).toEqual([1, 2, NaN, NaN, 5]);
    expect(shadesOf(columns, of.middle)).toEqual([
      { from: 1, to: 2, kind: "doubtful" },
      { from: 2, to: 4, kind: "unknown" },
    ]);
    expect(resample({ times: of.times, values: of.middle }, [0.5, 1.5, 2.5])).toEqual([
      1.5,
      null,
      null,
    ]);
  });

  it("breaks where frames were left out", () => {
    const times = [0, 0.1, 0.2, 0.7, 0.8, 0.9];
    const found = withGaps({ time_s: times, payload_p50_kg: [1, 2, 3, 4, 5, 6] });
    expect(found["payload_p50_kg"]).toEqual([1, 2, 3, null, 4, 5, 6]);
    const hatched = shadesOf(found, numbers(found, "payload_p50_kg"));
    expect(hatched.map((one) => [one.from, one.to])).toEqual([[expect.closeTo(0.3), 0.7]]);
  });

  it("ends a stretch with the recording", () => {
    expect(stretches([0, 1, 2], (i) => i > 0)).toEqual([{ from: 1, to: 2 }]);
  });

  it("gives a vector's size the spread along it", () => {
    const of = sizeCourse(
      {
        time_s: [0],
        f_x_n: [3],
        f_y_n: [0],
        f_z_n: [4],
        f_sd_x_n: [1],
        f_sd_y_n: [100],
        f_sd_z_n: [0],
      },
      "f",
      "n",
    );
    expect(of.middle).toEqual([5]);
    expect(of.high[0]).toBeCloseTo(5 + 1.6449 * 0.6, 9);
  });

  it("asks for the columns that are there alone", () => {
    const asked = plottedColumns(
      estimate({ columns: ["time_s", "payload_p50_kg", "jL5S1_effort_p50_nm", "odd"] }),
    );
    expect(asked).toEqual(["payload_p50_kg", "jL5S1_effort_p50_nm"]);
  });

  it("leaves a gap a gap, and a peak beside it a peak, however far it thins", () => {
    const values = Array.from({ length: 10_000 }, (_, i) =>
      i >= 5000 && i < 5005 ? NaN : i === 5010 ? 9 : 1,
    );
    const kept = keepExtremes([values], 100).map((index) => values[index]!);
    expect(kept.length).toBeLessThan(400);
    expect(kept.some(Number.isNaN)).toBe(true);
    expect(Math.max(...kept.filter((value) => !Number.isNaN(value)))).toBe(9);
  });

  it("plays the body from its columns, in their order", () => {
    const body = postureOf(
      {
        time_s: [0, 1],
        pelvis_position_x_m: [0, 1],
        pelvis_position_y_m: [0, 2],
        pelvis_position_z_m: [1, 3],
        pelvis_orientation_x: [0, 0],
        pelvis_orientation_y: [0, 0],
        pelvis_orientation_z: [0, 1],
        pelvis_orientation_w: [1, 0],
        jL5S1_rotx_angle_rad: [0, 0.1],
        jL5S1_roty_angle_rad: [0, 0.2],
        jL5S1_effort_p50_nm: [null, 30],
      },
      40,
    );
    expect(body.joint_names).toEqual(["jL5S1_rotx", "jL5S1_roty"]);
    expect(body.joint_position[1]).toEqual([0.1, 0.2]);
    expect(body.base.position_m[1]).toEqual([1, 2, 3]);
    expect(body.base.orientation_xyzw[1]).toEqual([0, 0, 1, 0]);
    expect(body.effort_p50_nm).toEqual({ jL5S1: [NaN, 30] });
    expect(body.effort_scale_nm).toEqual({ jL5S1: 40 });
  });
});

describe("the form", () => {
  const form = (fields: Record<string, string>) => {
    const data = new FormData();
    for (const [key, value] of Object.entries(fields)) data.set(key, value);
    return estimateOptions(data);
  };

  it("leaves out what was not given", () => {
    expect(
      form({ height_m: "1.75", mass_kg: "", sex: "male", tare_from: "", tare_to: "" }),
    ).toEqual({
      options: { height_m: 1.75, sex: "male" },
    });
    expect(
      form({ height_m: "1.75", tare_from: "0", tare_to: "1", accept: "sides, units" }),
    ).toEqual({
      options: { height_m: 1.75, tare_s: [0, 1], accept: ["sides", "units"] },
    });
  });

  it.each([
    [{}, "The height is missing: it scales the body."],
    [{ height_m: "1.7", tare_from: "1" }, "one of them is missing"],
    [{ height_m: "1.7", tare_from: "2", tare_to: "1" }, "The tare ends before it starts."],
    [{ height_m: "1.7", mass_kg: "heavy" }, "Mass is not a number."],
  ])("says what is wrong with %j", (fields, text) => {
    const read = form(fields as Record<string, string>);
    expect("faults" in read && read.faults.map((one) => one.detail).join(" ")).toContain(text);
  });
});

it("addresses an estimate", () => {
  expect(parseRoute("#/estimates/est_1")).toEqual({ page: "estimate", estimate: "est_1" });
  expect(parseRoute("#/estimates")).toEqual({ page: "estimate", estimate: null });
  expect(formatRoute({ page: "estimate", estimate: "a/b" })).toBe("#/estimates/a%2Fb");
});
