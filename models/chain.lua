-- A cable, modelled as a chain of equal bars that hangs between two points of equal height; at the time `release` its right
-- end is let go. Checked: it starts as the polygon in which such bars hang, tan(slope of bar i) = m g (n + 1 - 2 i) / (2 H);
-- the polygon approaches the catenary; and the end of a folded chain falls in 0.847 of the time of a free fall (Calkin and
-- March, American Journal of Physics 57, 1989). Dimensions are our own.
local rd = require "refdyn"
local n  = rd.option("bars", 12, { from = 2 })
local p  = rd.parameters {
  { "length", 3, "m" }, { "mass", 0.6, "kg" }, { "d", 0.01, "m" }, { "g", 9.81, "m/s^2" },
  { "pull", 1.2, "N" }, { "release", 0.2, "s" },                        -- pull: H, determines the span
}
local bar = p.length / n

local links, span, above = {}, 0, 0
for i = 1, n do
  local slope = rd.atan(p.mass / n * p.g * (n + 1 - 2 * i) / (2 * p.pull))
  links[i] = { "bar" .. i, on = i > 1 and "bar" .. i - 1 or nil, at = { i > 1 and bar or 0, 0, 0 },
               joint = "theta", start = { theta = slope - above },
               bodies = { rd.cylinder { diameter = p.d, length = bar, mass = p.mass / n, at = { bar / 2, 0, 0 } } } }
  span, above = span + bar * rd.cos(slope), slope
end

return rd.model {
  name = "chain", gravity = { 0, 0, -p.g },
  links = links,
  points = { middle = { on = "bar" .. n // 2, at = { bar, 0, 0 } }, tip = { on = "bar" .. n, at = { bar, 0, 0 } } },
  constraints = function(s)
    local tip, held = s.points.tip, rd.less(s.t, p.release)
    return { rd.position { held * (tip.x - span), name = "across", alpha = 20, beta = 20 },
             rd.position { held * tip.z, name = "height", alpha = 20, beta = 20 } }
  end,
}
