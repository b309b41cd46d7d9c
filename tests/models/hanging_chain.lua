-- A chain of `links` equal thin rods that hangs from a hinge, 1 m long, with a total mass of 1 kg. With more links its
-- frequencies approach those of a heavy string, omega = j_0k / 2 sqrt(g / L), j_0k the zeros of the Bessel function J0
-- (D. Bernoulli 1733). The error of each is proportional to 1 / links^2.
local rd = require "refdyn"
local n = rd.option("links", 8, { from = 1 })
local l = 1 / n

local links = {}
for i = 1, n do
  links[i] = { "rod" .. i, on = i > 1 and "rod" .. i - 1 or nil, at = { 0, 0, i > 1 and -l or 0 }, joint = "theta",
               mass = l, center = { 0, 0, -l / 2 }, inertia = { yy = l^3 / 12 } }
end

return rd.model { name = "hanging_chain", gravity = { 0, 0, -9.81 }, links = links, points = { E = { on = "rod" .. n, at = { 0, 0, -l } } } }
