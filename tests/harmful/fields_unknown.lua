-- expect: 4: more than 10000 entries in a table
-- Tries a table of 100,000 unknown fields.
local rd = require "refdyn"
local t = { "a", joint = "x", mass = 1 }
for i = 1, 1e5 do t["field" .. i] = 1 end
return rd.model { name = "harmful", links = { t } }
