local rd = require "refdyn"
local p = rd.parameters { { "e", 0.3 }, { "tilt", 0, "rad" }, {"off", 0, "m"} }
local function leg(x, y) return { on = "top", at = { x, y, -0.5 } } end
return rd.model {
  name = "tab", gravity = { 0, 0, -9.81 },
  links = { { "top", joint = "z, theta, phi", bodies = { rd.box { { 1, 1, 0.04 }, mass = 10 } }, start = { z = 0.7, phi = p.tilt } },
   {"load", on="top", at = {p.off, p.off/2, 0.1}, mass = 2 } },
  points = { a = leg(0.4, 0.4), b = leg(-0.4, 0.4), c = leg(-0.4, -0.4), d = leg(0.4, -0.4) },
  constraints = function(s) local r = {}
    for _, k in ipairs { "a", "b", "c", "d" } do r[#r+1] = rd.contact { s.points[k].z, restitution = p.e, name = "leg_" .. k } end
    return r end,
}
