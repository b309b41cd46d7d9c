-- expect of gen: 0: more than 16 million operations on expressions to derive its equations
-- Tries 150 loops over a chain of 200 links: the rows of each are derived along the whole chain.
local rd = require "refdyn"
local links, n = {}, 200
for i = 1, n do
  links[i] = { "a" .. i, on = i > 1 and "a" .. (i - 1) or nil, at = { 1, i / 300, 0 }, joint = "psi, theta", mass = i,
    inertia = { xx = 1, yy = 1, zz = 1 } }
end
return rd.model { name = "harmful", gravity = { 0, 0, -9.81 }, links = links,
  constraints = function() local rows = {} for i = 1, n / 2 do rows[i] = rd.loop { "a" .. i, "a" .. (n + 1 - i) } end return rows end }
