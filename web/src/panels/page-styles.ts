import { css } from "lit";

/** The grid both pages share: what was found, the body, the plots; one column on a phone. */
export const pageStyles = css`
  :host {
    display: block;
  }
  main {
    display: grid;
    grid-template-columns: minmax(17rem, 21rem) minmax(20rem, 1fr) minmax(20rem, 27rem);
    grid-template-areas:
      "answer answer answer"
      "left body plots"
      "more more more";
    gap: 0.9rem;
    padding: 0.9rem 1.2rem 1.5rem;
    max-width: 118rem;
    margin: 0 auto;
  }
  .answer {
    grid-area: answer;
  }
  .answer h1 {
    font-size: 1.55rem;
    line-height: 1.2;
    font-weight: 640;
    letter-spacing: -0.018em;
  }
  .answer p {
    margin-top: 0.25rem;
    color: var(--ink-soft);
    max-width: 90ch;
  }
  .left {
    grid-area: left;
  }
  .body {
    grid-area: body;
  }
  .plots {
    grid-area: plots;
  }
  .left,
  .body,
  .plots {
    height: max(37rem, calc(100vh - 12.6rem));
    min-width: 0;
    display: flex;
    flex-direction: column;
    gap: 0.9rem;
  }
  .grow {
    flex: 1;
    min-height: 0;
  }
  .moments {
    padding: 0.6rem 0.6rem 0.5rem;
    max-height: 12rem;
    overflow-y: auto;
    flex: none;
  }
  .moments h2 {
    padding: 0 0.5rem 0.3rem;
  }
  .stack {
    padding: 0.55rem 0.7rem 0.3rem;
    display: flex;
    flex-direction: column;
    gap: 0.3rem;
    flex: 1;
    min-height: 0;
  }
  .stack ec-chart {
    flex: 1;
  }
  .stack ec-chart.tall {
    flex: 1.7;
  }
  .stack ec-chart[timeaxis] {
    flex: 1.35;
  }
  ec-chart select {
    min-height: 0;
    padding: 0 0.2rem;
    font-size: 0.86rem;
    max-width: 12rem;
  }
  .more {
    grid-area: more;
    display: grid;
    grid-template-columns: minmax(0, 1.8fr) minmax(18rem, 1fr);
    gap: 0.9rem;
    align-items: start;
  }
  .more > section:only-child {
    grid-column: 1 / -1;
  }
  .more > section {
    padding: 0.8rem 1rem;
    min-width: 0;
  }
  .more h2 {
    margin-bottom: 0.5rem;
  }
  .more section > * + h2 {
    margin-top: 1.1rem;
  }
  .empty {
    grid-column: 1 / -1;
    padding: 3rem 1rem;
    text-align: center;
  }
  @media (max-width: 1100px) {
    main {
      grid-template-columns: minmax(0, 1fr) minmax(0, 1fr);
      grid-template-areas:
        "answer answer"
        "left body"
        "plots plots"
        "more more";
    }
    .plots {
      height: 36rem;
    }
  }
  @media (max-width: 760px) {
    main {
      grid-template-columns: minmax(0, 1fr);
      grid-template-areas: "answer" "left" "body" "plots" "more";
      padding: 0.8rem 0.7rem 1.2rem;
    }
    .answer h1 {
      font-size: 1.3rem;
    }
    .left,
    .body {
      height: auto;
    }
    .left ec-candidates {
      max-height: 40rem;
    }
    .body ec-player {
      height: 27rem;
      flex: none;
    }
    .moments {
      max-height: none;
    }
    .plots {
      height: 38rem;
    }
    .more {
      grid-template-columns: minmax(0, 1fr);
    }
  }
`;
