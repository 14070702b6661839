import "@fontsource-variable/inter/wght.css";
import "./styles.css";
import "./panels/ec-app";
