-- expect: 4: more than 10000 entries in a table
-- Tries an option of 100,000 choices.
local rd = require "refdyn"
local t = {}
for i = 1, 1e5 do t[i] = "choice" .. i end
local c = rd.option("c", "none", t)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
