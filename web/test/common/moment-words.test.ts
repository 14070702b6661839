import { describe, expect, it } from "vitest";

import { jointOfMoment, momentWords } from "../../src/common/moment-words";

describe("momentWords", () => {
  it("does not say the score and the part twice", () => {
    const reason =
      "RULA 5 (investigate and change soon): right upper arm raised by 62 deg (3); abducted";
    expect(momentWords({ time_s: 1, body_part: "right upper arm", reason })).toEqual({
      part: "Right upper arm",
      matter: "raised by 62 deg (3); abducted",
    });
  });

  it("joins reasons, and names the side where no part is to blame", () => {
    expect(
      momentWords({ time_s: 0, side: "left", body_part: "none", reasons: ["a", "b"] }),
    ).toEqual({
      part: "Left",
      matter: "a; b",
    });
    expect(momentWords({ time_s: 0 })).toEqual({ part: "", matter: "" });
  });
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
