-- expect: 4: more than 10000 entries in a table
-- Tries a list of 200,000 points.
local rd = require "refdyn"
local t = {}
for i = 1, 2e5 do t["p" .. i] = "a" end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } }, points = t }
