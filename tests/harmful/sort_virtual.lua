-- expect: 5: table.sort: the table has __len; must be a table without it
-- Tries to sort a list of 2^31 entries that only claims them.
local rd = require "refdyn"
local t = setmetatable({}, { __len = function() return 2^31 - 2 end, __index = function() return 1 end })
table.sort(t)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
