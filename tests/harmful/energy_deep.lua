-- expect of gen: 0: more than 16 million operations on expressions to derive its equations
-- Tries an energy of 9,000 nested formulas of 12 coordinates, which is differentiated twice.
local rd = require "refdyn"
local links, names = {}, {}
for i = 1, 12 do
  links[i] = { "a" .. i, on = i > 1 and "a" .. (i - 1) or nil, at = { 1, i / 10, 0 }, joint = "psi", mass = i, inertia = { zz = 1 } }
  names[i] = "a" .. i .. "_psi"
end
return rd.model { name = "harmful", gravity = { 0, 0, -9.81 }, links = links,
  forces = function(s)
    local e, next = s.q.a1_psi, { 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 1 }
    local at = 1
    for i = 1, 9000 do
      at = next[at]
      e = rd.sin(e * (1 + i / 7)) + s.q[names[at]] * i
    end
    return { rd.energy { e } }
  end }
