-- expect: 0: more than 256 MB of memory to read the model
-- Tries tables of tables.
local rd = require "refdyn"
local t = {}
while true do t = { t, {}, {}, {} } end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
