-- expect: 4: more than 10000 entries in a table
-- Tries a link of 100,000 bodies.
local rd = require "refdyn"
local t = {}
for i = 1, 1e5 do t[i] = rd.box { { 1, 1, i }, density = 1 } end
return rd.model { name = "harmful", links = { { "a", joint = "x", bodies = t } } }
