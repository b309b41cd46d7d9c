-- expect: 4: more than 10000 entries in a table
-- Tries unknown names among 20,000 known ones.
local rd = require "refdyn"
local t, links = {}, {}
for i = 1, 5000 do t[i] = "nothing_of_that_name_" .. i end
for i = 1, 20000 do links[i] = { "nothing_of_this_name_" .. i, joint = "x", mass = 1 } end
return rd.model { name = "harmful", links = links, hold = t }
