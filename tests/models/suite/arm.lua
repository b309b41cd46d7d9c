-- A steel rod that falls, turns or is pushed: the flexible arm of the suite. Its options select the root and the
-- loads, its parameters the extremes. `push` begins at `t_push`; the row, if any, moves the tip along y or keeps a
-- coordinate at its start.
local rd = require "refdyn"
local n = rd.option("n_rfe", 4, { from = 2 })
local dofs = rd.option("dofs", "psi")                                      -- of each spring-damping element
local root = rd.option("root", "hinge", { "hinge", "clamp", "angles" })
local drive = rd.option("drive", "step", { "step", "input" })
local row = rd.option("row", "none", { "none", "swing", "lock_root", "lock_element" })
local p = rd.parameters {
  { "L", 1, "m" }, { "d", 0.01, "m" }, { "E", 2.1e11, "Pa" }, { "rho", 7800, "kg/m^3" }, { "ratio", 0.01, "1" },
  { "m_E", 0.5, "kg" }, { "g", 9.81, "m/s^2" }, { "rate", 0, "rad/s" }, { "start", 0, "rad" },
  { "push", 0, "N m" }, { "t_push", 0.1, "s" }, { "stroke", 0.1, "m" }, { "omega", 1, "rad/s" },
}
local push = drive == "input" and rd.input("push_now", 0, "N m")
local axes = { hinge = "psi", angles = "psi, theta, phi" }
local turning = root ~= "clamp" and "arm_psi" or "arm_psi_1"

return rd.model {
  name = "suite_arm", gravity = { 0, -p.g, 0 },
  links = {
    { "arm", joint = axes[root], start = root ~= "clamp" and { psi = p.start } or nil,
      start_rate = root ~= "clamp" and { psi = p.rate } or nil,
      inertia = root == "angles" and { xx = 0.01, yy = 0.01, zz = 0.01 } or nil, mass = root == "angles" and 0.1 or nil,
      beam = { length = p.L, section = rd.round(p.d), E = p.E, nu = 0.3, rho = p.rho, rfe = n, dofs = dofs,
               damping = { ratio = p.ratio } } },
    { "load", on = "arm.tip", mass = p.m_E },
  },
  points = { E = "load" },
  forces = function(s) return { [turning] = push or rd.where(rd.less(s.t, p.t_push), 0, p.push) } end,
  constraints = function(s)
    local rows = {
      none = {},
      swing = { rd.position { s.points.E.y - p.stroke * rd.sin(p.omega * s.t)^2, alpha = 50, beta = 50 } },
      lock_root = { rd.lock { "arm_psi" } },
      lock_element = { rd.lock { "arm_psi_1" } },
    }
    return rows[row]
  end,
}
