-- A free-floating satellite whose arm has a stiff and a flexible link, with internal drives at the joints. Checked: without
-- external forces, linear and angular momentum are constant, and the centre of mass moves with constant velocity.
local rd = require "refdyn"
local n  = rd.option("n_rfe", 3, { from = 1 })
local p  = rd.parameters {
  { "E", 7e10, "Pa" }, { "nu", 0.33, "1" }, { "rho", 2700, "kg/m^3" }, { "m", 12, "kg" }, { "tau", 2, "N m" },
  { "T", 4, "s" },
}
local function push(t) return p.tau * rd.sin(2 * rd.pi * t / p.T) * rd.smoothstep(t, 0, 0.2) end

return rd.model {
  name = "spacearm",
  links = {
    { "satellite", joint = "free", start = { psi = 0.2, theta = -0.3 },
      start_rate = { x = 0.1, phi = 0.02, psi = -0.05 },
      bodies = { rd.box { { 1.2, 1, 0.8 }, mass = 150 },
                 rd.box { { 0.4, 4, 0.02 }, mass = 8, at = { -0.3, 0, 0.4 }, turn = { { "y", 0.4 } } },
                 rd.sphere { diameter = 0.5, density = 300, at = { -0.5, 0, -0.3 } } } },
    { "shoulder", on = "satellite", at = { 0.6, 0, 0.2 }, joint = "psi, theta", start = { theta = -0.5 },
      bodies = { rd.tube { outer = 0.1, inner = 0.09, length = 1.5, density = p.rho, at = { 0.75, 0, 0 } } } },
    { "fore", on = "shoulder", at = { 1.5, 0, 0 }, joint = "theta", start = { theta = 1 }, damper = { theta = 0.1 },
      beam = { length = 1.6, section = rd.tube(0.04, 0.036), E = p.E, nu = p.nu, rho = p.rho, eta = 1e-3, rfe = n } },
    { "payload", on = "fore.tip", mass = p.m, center = { 0.2, 0.05, 0 }, inertia = { xx = 0.3, yy = 0.4, zz = 0.4 } },
  },
  points = { hull = "satellite", elbow = "fore", payload = { on = "payload", at = { 0.2, 0.05, 0 } } },
  forces = function(s)
    return { shoulder_psi = push(s.t), shoulder_theta = -0.5 * push(1.3 * s.t),
             rd.torque { "fore", { 0, 0.4 * push(2 * s.t), 0 }, axes = "fore", against = "shoulder" } }
  end,
}
