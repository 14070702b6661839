import { describe, expect, it } from "vitest";

import { ProblemError, asProblem, problemOf } from "../../src/data/problems";

describe("problemOf", () => {
  it("takes problem+json as it is", async () => {
    const body = { type: "/problems/x", title: "No", status: 422, errors: [{ pointer: "/a" }] };
    expect(await problemOf(new Response(JSON.stringify(body), { status: 422 }))).toEqual(body);
  });

  it("sums up an answer that is no problem document", async () => {
    const problem = await problemOf(
      new Response("<h1>Bad gateway</h1>", { status: 502, statusText: "Bad Gateway" }),
    );
    expect(problem.title).toBe("The service answered 502 Bad Gateway");
    expect(problem.detail).toContain("Bad gateway");
    expect((await problemOf(new Response("[1]", { status: 500 }))).status).toBe(500);
  });
});

it("asProblem keeps a problem and makes one of anything else", () => {
  const problem = { type: "t", title: "No", status: 404 };
  expect(asProblem(new ProblemError(problem))).toBe(problem);
  expect(asProblem(new Error("boom")).detail).toBe("boom");
  expect(asProblem("text").detail).toBe("text");
});
