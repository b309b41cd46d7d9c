-- expect of gen: 0: more than 12 million operations on expressions to derive its equations
-- Tries an energy of 9,000 nested formulas of 12 coordinates, which is differentiated twice.
local rd = require "refdyn"
local links = {}
for i = 1, 12 do
  links[i] = { "a" .. i, on = i > 1 and "a" .. (i - 1) or nil, at = { 1, i / 300, 0 }, joint = i // 2 * 2 == i and "psi" or "theta", mass = i,
    inertia = { xx = 1, yy = 1, zz = 1 } }
end
return rd.model { name = "harmful", gravity = { 0, 0, -9.81 }, links = links,
  forces = function(s)
    local e = s.q.a1_theta
    for i = 1, 9000 do e = rd.sin(e * (1 + i / 7)) + s.q[i // 2 * 2 == i and "a2_psi" or "a" .. 1 + 2 * (i // 2 - i // 12 * 6) .. "_theta"] * i end
    return { rd.energy { e } }
  end }
