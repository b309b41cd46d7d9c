-- Tries tables of tables.
local rd = require "refdyn"
local t = {}
while true do t = { t, {}, {}, {} } end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
