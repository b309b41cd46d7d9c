-- A four-bar linkage (crank-rocker) in the vertical x-y plane. A motor with constant torque turns the crank from rest.
-- Checked against closed forms: the rocker's angle by Freudenstein's equation, and the crank's rate from the work of the
-- motor and of gravity.
-- With spatial joints, three of the rows that close the linkage are redundant.
local rd = require "refdyn"
local joints = rd.option("joints", "planar", { "planar", "spatial" })
local p  = rd.parameters {
  { "a", 0.2, "m" }, { "b", 0.6, "m" }, { "c", 0.45, "m" }, { "d", 0.55, "m" },        -- crank, coupler, rocker, ground
  { "crank", 1.1, "rad" }, { "g", 9.81, "m/s^2" }, { "rho", 2700, "kg/m^3" },
}

local torque = rd.input("torque", 1.5, "N m")

-- Start angles of rocker and coupler that close the loop, from the diagonal between crank pin and rocker pivot.
local x, y     = p.d - p.a * rd.cos(p.crank), -p.a * rd.sin(p.crank)
local diagonal = rd.sqrt(x^2 + y^2)
local coupler  = rd.atan2(y, x) + rd.acos((diagonal^2 + p.b^2 - p.c^2) / (2 * diagonal * p.b))
local rocker   = rd.atan2(y, x) + rd.pi - rd.acos((diagonal^2 + p.c^2 - p.b^2) / (2 * diagonal * p.c))

local function bar(length) return { rd.box { { length, 0.04, 0.01 }, density = p.rho, at = { length / 2, 0, 0 } } } end

return rd.model {
  name = "fourbar", gravity = { 0, -p.g, 0 },
  links = {
    { "crank", joint = "psi", start = { psi = p.crank }, bodies = bar(p.a) },
    { "coupler", on = "crank", at = { p.a, 0, 0 }, joint = "psi", start = { psi = coupler - p.crank },
      bodies = bar(p.b) },
    { "rocker", at = { p.d, 0, 0 }, joint = "psi", start = { psi = rocker }, bodies = bar(p.c) },
  },
  points = { pin = { on = "coupler", at = { p.b, 0, 0 } }, rocker = { on = "rocker", at = { p.c, 0, 0 } } },
  forces = function() return { crank_psi = torque } end,
  constraints = function()
    if joints == "spatial" then return { rd.close { "pin", "rocker", joint = "psi", alpha = 50, beta = 50 } } end
    return { rd.loop { "pin", "rocker", keep = "x, y", alpha = 50, beta = 50 } }
  end,
}
