-- The manipulator with a flexible arm of "Reference Dynamics Based Motion Planning for Robotic Systems with
-- Flexible Components", Sect. 5.5. Values that the chapter does not print are marked as assumed.
local rd      = require "refdyn"
local n       = rd.option("n_rfe", 4, { from = 1 })                     -- rigid finite elements; 1: rigid arm
local program = rd.option("program", "consistent", { "consistent", "chapter", "none" })
local dofs    = rd.option("dofs", "psi,theta,phi")                      -- of each spring-damping element
local drive   = rd.option("drive", "course", { "course", "input" })
local driven  = rd.option("driven", false)                              -- with drives that can perform the programme
local name    = rd.option("name", "manipulator")                        -- of the emitted files
local form    = rd.option("form", "corrected", { "corrected", "printed" })
local p       = rd.parameters {
  { "m_base", 18.54331045, "kg" }, { "s_sup", 1e4, "N/m" }, { "d_sup", 2.5, "N s/m" },  -- mass assumed
  { "m_col", 10, "kg" }, { "h", 1.1, "m" }, { "Izz_col", 0.05, "kg m^2" },              -- assumed
  { "L", 2, "m" }, { "d", 0.01413200743, "m" },                                         -- assumed
  { "E", 2.1e11, "Pa" }, { "nu", 0.3, "1" }, { "rho", 7801, "kg/m^3" }, { "eta", 0, "s" },
  { "m_E", 2, "kg" }, { "g", 9.81, "m/s^2" },                                           -- g assumed
  { "a", 0.875, "m" }, { "b", 1.75, "m" }, { "alpha", 1e3, "1/s" }, { "beta", 1e2, "1/s" },
  { "v0", 0.05, "m/s" }, { "T", 10, "s" },                                              -- v0 assumed
}
local tau = drive == "input" and rd.input("tau", 0, "N m")

local function torque(t, rate) return 2 * rd.ramp(t, 0, 2) - 0.5 * rate end             -- assumed: a figure only
local function rise(t) return p.v0 * rd.sin(rd.pi * t / p.T)^2 end                      -- assumed: a figure only

return rd.model {
  name = name, form = form, gravity = { 0, 0, -p.g },
  links = {
    { "base", joint = { "z" }, mass = p.m_base, spring = { z = p.s_sup }, damper = { z = p.d_sup } },
    { "column", on = "base", joint = { "psi" }, mass = p.m_col, center = { 0, 0, p.h / 2 },
      inertia = { zz = p.Izz_col } },                                   -- other moments have no effect
    { "arm", on = "column", at = { 0, 0, p.h }, turn = { { "x", rd.pi / 2 } },
      joint = { "psi" }, start = { psi = rd.pi / 4 },
      beam = { length = p.L, section = rd.round(p.d), E = p.E, nu = p.nu, rho = p.rho, eta = p.eta,
               rfe = n, dofs = dofs, springs = "printed" } },                 -- form of the chapter and of all reference values
    { "effector", on = "arm.tip", turn = { { "y", rd.pi / 2 } }, joint = { "z" }, mass = p.m_E },
  },
  points      = { E = "effector" },
  forces      = function(s) return { column_psi = tau or torque(s.t, s.qd.column_psi) } end,
  courses     = function(s)
    return { torque = tau or torque(s.t, s.qd.column_psi), vertical_velocity = program ~= "none" and rise(s.t) or nil }
  end,
  constraints = function(s)
    local E  = s.points.E
    local xc = rd.parameter("xc", s.start.points.E.x - p.a, "m")        -- the start lies on the ellipse
    local x  = program == "chapter" and E.x or E.x - xc                 -- chapter: centre on the column
    if program == "none" then return {} end
    return {
      rd.position { (x / p.a)^2 + (E.y / p.b)^2 - 1, alpha = p.alpha, beta = p.beta, name = "ellipse" },
      rd.velocity { E.zd - rise(s.t), alpha = p.alpha, name = "rise" },
    }
  end,
  drives    = driven and { "arm_psi", "effector_z" } or nil,
  dependent = program ~= "none" and { "arm_psi", "effector_z" } or nil,
  hold      = { "column_psi", "arm_psi", "effector_z" },
}
