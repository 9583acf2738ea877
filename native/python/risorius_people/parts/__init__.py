# SPDX-License-Identifier: MIT
"""What is made by code of the base mesh: lips that rest on each other, teeth and gums, a shirt;
what keeps the tongue on the lip.
"""
