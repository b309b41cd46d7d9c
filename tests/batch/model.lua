-- A pendulum of two or three rods with a torque at its hinge, for the tests of batches.
local rd     = require "refdyn"
local pieces = rd.option("pieces", 2, { 2, 3 })
local p      = rd.parameters { { "mass", 1, "kg" }, { "friction", 0.03, "N m s" } }
local torque = rd.input("torque", 0.1, "N m")
local names  = { "arm", "second", "third" }
local links  = {}
for i = 1, pieces do
  links[i] = { names[i], on = names[i - 1], at = i > 1 and { 0.4, 0, 0 } or nil, turn = i == 1 and { { "x", rd.pi / 2 } } or nil,
               joint = { "psi" }, start = { psi = i > 1 and 0.05 or 0.2 }, mass = p.mass, center = { 0.2, 0, 0 },
               inertia = { zz = 0.02 }, damper = { psi = p.friction } }
end
return rd.model {
  name = "batch", gravity = { 0, 0, -9.81 }, links = links,
  points = { tip = { on = names[pieces], at = { 0.4, 0, 0 } } },
  forces = function(s) return { arm_psi = torque } end,
}
