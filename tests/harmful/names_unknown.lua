-- expect: 4: more entries in a table than 10000
-- Tries 100,000 unknown names.
local rd = require "refdyn"
local t = {}
for i = 1, 1e5 do t[i] = "nothing_of_that_name_" .. i end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } }, hold = t, dependent = t }
