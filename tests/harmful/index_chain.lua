-- expect: 7: C stack overflow: calls, parentheses, tables or blocks are nested too deeply
-- Tries a chain of 2,000 tables that look in each other.
local rd = require "refdyn"
local base = {}
for i = 1, 1900 do base = setmetatable({}, { __index = base }) end
local n = 0
while true do n = base.x end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
