-- Tries 10,000 points.
local rd = require "refdyn"
local t = {}
for i = 1, 10000 do t["p" .. i] = "a" end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } }, points = t }
