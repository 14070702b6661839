import { describe, expect, it } from "vitest";

import { distinctMoments, jointOfMoment, momentWords } from "../../src/common/moment-words";

describe("momentWords", () => {
  it("does not say the score and the part twice", () => {
    const reason =
      "RULA 5 (investigate and change soon): right upper arm 3: flexion 62° (45° to 90°); +1: abducted";
    expect(momentWords({ time_s: 1, body_part: "right upper arm", reason })).toEqual({
      part: "Right upper arm",
      matter: "flexion 62° (45° to 90°), 3 points; +1: abducted",
      more: [],
    });
  });

  it("leads with the first reason and keeps the others at hand", () => {
    const reasons = ["trunk 1: flexion 3° (-5° to 5°)", "wrist_twist 1: -5° to 5°"];
    expect(momentWords({ time_s: 0, side: "left", body_part: "trunk", reasons })).toEqual({
      part: "Trunk",
      matter: "flexion 3° (-5° to 5°), 1 point",
      more: ["wrist twist 1: -5° to 5°"],
    });
  });

  it("names the side where no part is to blame, and nothing where nothing is said", () => {
    expect(momentWords({ time_s: 0, side: "left", body_part: "none" }).part).toBe("Left");
    expect(momentWords({ time_s: 0 })).toEqual({ part: "", matter: "", more: [] });
  });
});

it("distinctMoments says the same thing once, at its first time", () => {
  const same = { body_part: "left upper arm", reason: "held", score: 3 };
  const moments = [
    { time_s: 2, ...same },
    { time_s: 0, ...same },
    { time_s: 1, ...same, score: 4 },
  ];
  expect(distinctMoments(moments).map((moment) => moment.time_s)).toEqual([2, 1]);
});

describe("jointOfMoment", () => {
  it.each([
    [{ body_part: "right upper arm" }, "jRightShoulder"],
    [{ body_part: "left lower arm", side: "left" }, "jLeftElbow"],
    [{ body_part: "trunk", side: "right" }, "jL5S1"],
    [{ body_part: "neck" }, "jT1C7"],
    [{ body_part: "grip", side: "right" }, null],
    [{ body_part: "trunk", effort_joint: "jRightElbow" }, "jRightElbow"],
  ])("%j is borne by %s", (moment, joint) =>
    expect(jointOfMoment({ time_s: 0, ...moment })).toBe(joint),
  );
});
