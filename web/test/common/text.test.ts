import { describe, expect, it } from "vitest";

import { anything, counted, figure, percent } from "../../src/common/format";
import { compareJoints, jointWords, words } from "../../src/common/names";
import { formatRoute, parseRoute } from "../../src/common/route";

describe("percent", () => {
  it.each([
    [0, "0 %"],
    [0.004, "< 1 %"],
    [0.126, "13 %"],
    [0.996, "> 99 %"],
    [1, "100 %"],
  ])("%d is written %s", (value, text) => expect(percent(value)).toBe(text));
});

describe("counted", () => {
  it.each([
    [1, 64, "> 98 %"],
    [0, 64, "< 2 %"],
    [63 / 64, 64, "98 %"],
    [0.5, 64, "50 %"],
    [1, 2000, "> 99 %"],
    [0, 2000, "< 1 %"],
    [1, 2, "> 50 %"],
  ])("%d over %d samples is written %s", (value, samples, text) =>
    expect(counted(value, samples)).toBe(text),
  );
});

describe("figure", () => {
  it.each([
    [0, "0"],
    [0.01234, "0.012"],
    [1.234, "1.23"],
    [-12.34, "-12.3"],
    [1234.5, "1235"],
  ])("%d is written %s", (value, text) => expect(figure(value)).toBe(text));
});

describe("anything", () => {
  it.each([
    [null, "–"],
    [[0, 10], "0 to 10"],
    [["low", "high"], "low, high"],
    [{ rula_min: 3, rula_max: 5 }, "rula min 3, rula max 5"],
    [true, "yes"],
  ])("%j is written %s", (value, text) => expect(anything(value)).toBe(text));
});

describe("names", () => {
  it("puts joints in words", () => {
    expect(jointWords("jRightShoulder")).toBe("Right shoulder");
    expect(jointWords("jLeftC7Shoulder")).toBe("Left shoulder girdle");
    expect(jointWords("jL5S1")).toBe("Low back (L5–S1)");
  });

  it("spaces out names it does not know", () => {
    expect(jointWords("upper_arm")).toBe("Upper arm");
    expect(words("RightUpperArm")).toBe("Right upper arm");
    expect(words("rula_mean")).toBe("RULA mean");
  });

  it("orders joints from the hand to the low back", () => {
    const chain = [
      "jL5S1",
      "jRightShoulder",
      "jT9T8",
      "jRightWrist",
      "jRightC7Shoulder",
      "jRightElbow",
    ];
    expect(chain.sort(compareJoints)).toEqual([
      "jRightWrist",
      "jRightElbow",
      "jRightShoulder",
      "jRightC7Shoulder",
      "jT9T8",
      "jL5S1",
    ]);
  });
});

describe("routes", () => {
  it.each([
    { page: "recording" as const },
    { page: "assessment" as const, assessment: "a/b", candidate: "c d%#" },
    { page: "assessment" as const, assessment: "a", candidate: null },
    { page: "assessment" as const, assessment: null, candidate: null },
  ])("survives the address: %j", (route) => expect(parseRoute(formatRoute(route))).toEqual(route));

  it("takes anything unknown for the newest assessment", () => {
    const home = { page: "assessment", assessment: null, candidate: null };
    expect(parseRoute("")).toEqual(home);
    expect(parseRoute("#/nowhere/%E0%A4%A")).toEqual(home);
  });
});
