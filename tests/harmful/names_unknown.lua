-- expect: 4: more than 10000 entries in a table
-- Tries 100,000 unknown names.
local rd = require "refdyn"
local t = {}
for i = 1, 1e5 do t[i] = "nothing_of_that_name_" .. i end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } }, hold = t, dependent = t }
