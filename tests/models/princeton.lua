-- The Princeton beam (Dowell and Traybar, 1975): a clamped aluminium strip with a transverse load at its tip, at an angle to its
-- stiff side, so that it bends in both planes and twists.
local rd = require "refdyn"
local n       = rd.option("n", 8, { from = 1 })                         -- spring-damping elements
local springs = rd.option("springs", "symmetric")
local curved  = rd.option("curved", false)                              -- bent and twisted without load
local P = rd.input("P", 13.345, "N")                                    -- the load
local p = rd.parameters { { "angle", 60, "deg" }, { "bend", 1.5, "rad/m" }, { "twist", 2, "rad/m" } }

return rd.model {
  name = "princeton",
  links = {
    { "strip", beam = { length = 0.508, section = rd.rectangle(12.377e-3, 3.2024e-3), E = 71.7e9, nu = 0.31, rho = 2700, rfe = n + 1,
                        springs = springs, curvature = curved and { theta = p.bend, phi = p.twist } or nil } },
  },
  points = { tip = "strip.tip" },
  forces = function()
    local angle = p.angle * rd.pi / 180
    return { rd.force { "tip", { 0, P * rd.sin(angle), P * rd.cos(angle) } } }
  end,
}
