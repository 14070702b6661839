/** Which page the address names; it stands after the `#`, so that the service needs to know one page only. */
export type Route =
  | { page: "assessment"; assessment: string | null; candidate: string | null }
  | { page: "recording" }
  | { page: "estimate"; estimate: string | null };

/** Reads an address; anything unknown is the page of the newest assessment. */
export function parseRoute(hash: string): Route {
  const parts = hash
    .replace(/^#?\/?/, "")
    .split("/")
    .map(decode);
  if (parts[0] === "recording") return { page: "recording" };
  if (parts[0] === "estimates") return { page: "estimate", estimate: parts[1] || null };
  const known = parts[0] === "assessments";
  return {
    page: "assessment",
    assessment: (known && parts[1]) || null,
    candidate: (known && parts[2]) || null,
  };
}

export function formatRoute(route: Route): string {
  if (route.page === "recording") return "#/recording";
  const [place, ids] =
    route.page === "estimate"
      ? ["#/estimates", [route.estimate]]
      : ["#/assessments", [route.assessment, route.candidate]];
  const parts = ids.filter((part) => part !== null);
  return [place, ...parts.map(encodeURIComponent)].join("/");
}

function decode(part: string): string {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}
