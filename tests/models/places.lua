-- Turned places: the axes of a point, a load along them, an axis of a row, a link next to the tip of a turned beam.
-- By hand, with a = arm_psi: the axes of P are Rz(a + 0.3) Ry(0.2); the torque (0, 2, 3) along them has 3 cos 0.2 about
-- z; the row, the gate's axis turned by 0.4 against y, is sin(gate_psi + 0.4); E is at
-- Rz(a) (0.2, 0, 0.1) + Rz(a) Rx(pi/2) ((0.5, 0, 0) + (0, 0.3, 0)).
local rd = require "refdyn"
local T = rd.input("T", 1, "1")

return rd.model {
  name = "places",
  links = {
    { "arm", joint = "psi", start = { psi = 0.5 }, mass = 2, center = { 0.2, 0, 0 }, inertia = { zz = 0.03 } },
    { "rod", on = "arm", at = { 0.2, 0, 0.1 }, turn = { { "x", rd.pi / 2 } },
      beam = { length = 0.5, section = rd.round(0.02), E = 7e10, nu = 0.3, rho = 2700, rfe = 1 } },
    { "beside", on = "rod.tip", at = { 0, 0.3, 0 }, mass = 0.1 },
    { "gate", joint = "psi", mass = 1, inertia = { zz = 0.1 } },
  },
  points = { P = { on = "arm", at = { 1, 0, 0 }, turn = { { "z", 0.3 }, { "y", 0.2 } } }, E = "beside" },
  forces = function() return { rd.torque { "arm", { 0, 2 * T, 3 * T }, axes = "P" } } end,
  courses = function(s)
    local axes, courses = s.points.P.axes, {}
    for _, axis in ipairs { "x", "y", "z" } do
      for _, part in ipairs { "x", "y", "z", "xd", "yd", "zd" } do courses[axis .. "_" .. part] = axes[axis][part] end
    end
    return courses
  end,
  constraints = function()
    return { rd.perpendicular { { "gate", "x", turn = { { "z", 0.4 } } }, { "ground", "y" }, alpha = 20, beta = 20 } }
  end,
}
