-- expect: 4: attempt to compare string with number
local rd = require "refdyn"
local t = { 1, "a" }
table.sort(t)
