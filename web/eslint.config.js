import tseslint from "typescript-eslint";

export default tseslint.config(
  { ignores: ["node_modules", "../app/static"] },
  ...tseslint.configs.recommended,
  {
    files: ["src/**/*.ts"],
    rules: {
      // Requests live in one folder, so that the contract with the service can be read in one place.
      "no-restricted-globals": ["error", "fetch"],
      eqeqeq: "error",
    },
  },
  { files: ["src/data/**/*.ts"], rules: { "no-restricted-globals": "off" } },
);
