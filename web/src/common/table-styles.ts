import { css } from "lit";

/** Small tables of figures: the first column in words, the others to the right. */
export const tableStyles = css`
  :host {
    display: block;
  }
  table {
    border-collapse: collapse;
    width: 100%;
  }
  th {
    font-weight: 560;
    font-size: 0.79rem;
    color: var(--ink-soft);
    text-align: right;
  }
  td {
    text-align: right;
  }
  th:first-child,
  td:first-child {
    text-align: left;
    padding-left: 0;
  }
  th,
  td {
    padding: 0.32rem 0 0.32rem 0.8rem;
    border-bottom: 1px solid var(--line);
  }
  tr:last-child td {
    border-bottom: none;
  }
`;
