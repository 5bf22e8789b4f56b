// Before the first paint: a night's eyes are not to be dazzled by a white page.
(function () {
  var known = ["day", "dusk", "night"];
  var palette = "";
  try { palette = localStorage.getItem("palette") || ""; } catch (error) { /* a file has no storage */ }
  if (known.indexOf(palette) < 0) {
    palette = matchMedia("(prefers-color-scheme: dark)").matches ? "dusk" : "day";
  }
  document.documentElement.dataset.palette = palette;
})();
