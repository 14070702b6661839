import type { Problem } from "./types";

/** A request that the service refused, or that never reached it; `problem` is ready to show. */
export class ProblemError extends Error {
  constructor(readonly problem: Problem) {
    super(problem.detail ?? problem.title);
    this.name = "ProblemError";
  }
}

/** Makes whatever was thrown presentable. */
export function asProblem(cause: unknown): Problem {
  if (cause instanceof ProblemError) return cause.problem;
  const detail = cause instanceof Error ? cause.message : String(cause);
  return { type: "about:blank", title: "Something went wrong on this page", status: 0, detail };
}

/** Reads the problem from a failed response; a body that is not problem+json is summed up. */
export async function problemOf(response: Response): Promise<Problem> {
  const text = await response.text();
  try {
    const body: unknown = JSON.parse(text);
    if (typeof body === "object" && body !== null && "title" in body) return body as Problem;
  } catch {
    // Not JSON: a proxy or a crash answered; say what it said.
  }
  return {
    type: "about:blank",
    title: `The service answered ${response.status} ${response.statusText}`.trim(),
    status: response.status,
    detail: text.slice(0, 400),
  };
}
