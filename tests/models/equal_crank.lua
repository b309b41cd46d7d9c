-- A slider-crank whose rod is as long as its crank: the slider stays on its line with rod_psi = -2 crank_psi. With an
-- upright crank, the slider is at its shaft, the row vanishes, and the rod could turn alone. `row` = angles
-- prescribes the same motion by a row that never vanishes.
local rd = require "refdyn"
local row = rd.option("row", "slide", { "slide", "angles" })
local function bar(m) return { rd.box { { 0.4, 0.02, 0.02 }, mass = m, at = { 0.2, 0, 0 } } } end
return rd.model {
  name = "equal_crank", gravity = { 1.3, -9.81, 0 },
  links = {
    { "crank", joint = "psi", start = { psi = 1.1 }, start_rate = { psi = 6 }, bodies = bar(0.9) },
    { "rod", on = "crank", at = { 0.4, 0, 0 }, joint = "psi", start = { psi = -2.2 }, start_rate = { psi = -12 }, bodies = bar(0.5) },
    { "slider", on = "rod", at = { 0.4, 0, 0 }, mass = 0.3 },
  },
  points = { pin = "slider" },
  constraints = function(s)
    if row == "angles" then return { rd.position { s.q.rod_psi + 2 * s.q.crank_psi, name = "line" } } end
    return { rd.position { s.points.pin.y, name = "line", alpha = 20, beta = 20 } }
  end,
}
