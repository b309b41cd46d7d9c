-- expect: 4: more than 10000 entries in a table
-- Tries a link of 100,000 joints.
local rd = require "refdyn"
local t = {}
for i = 1, 1e5 do t[i] = "x" end
return rd.model { name = "harmful", links = { { "a", joint = t, mass = 1 } } }
